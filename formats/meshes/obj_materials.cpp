// SPDX-License-Identifier: Apache-2.0
// Wavefront MTL materials (Alias|Wavefront, "MTL material format", 1995) with the PBR extension
// (Clara.io, "Extending Wavefront MTL for Physically-Based").
#include <algorithm>
#include <cmath>
#include <limits>
#include <numbers>
#include <string_view>

#include <peeler/error.h>
#include "formats/file/text_words.h"
#include "formats/meshes/mesh_parts.h"

namespace peeler {

struct ObjMaterials::Mtl {
    std::string name;
    glm::vec3 diffuse{1}, emissive{0}, filter{1};
    std::optional<float> dissolve{}, transparency{};
    float shininess = 0;               ///< exponent of the Phong model
    std::optional<float> roughness{};  ///< if set, overrides `shininess`
    float metallic = 0, sheen = 0, clearcoat = 0, clearcoat_roughness = 0;
    float anisotropy = 0, anisotropy_turn = 0;  ///< strength, and rotation in full turns
    MeshMap diffuse_map, opacity_map, emissive_map, roughness_map, metallic_map, normal_map;
    bool used = false, without_texcoords = false;
    /// Settings that are not supported, with their lines. They cause a warning if the material is
    /// used.
    std::vector<std::pair<std::string, std::string>> lost{};
};

namespace {

/// A statement with numeric arguments, and the function that stores them.
template <class Mtl>
struct NumberRow {
    std::string_view word;
    std::size_t count;
    float least, most;  ///< range of valid values
    void (*set)(Mtl& mtl, const glm::vec3& value);
};

template <class Mtl>
struct MapRow {
    std::string_view word;
    MeshMap Mtl::*map;
};

/// An option that may precede a texture's name, and the maximum number of its numeric arguments.
/// The number is 0 if the option's argument is a word.
struct MapOption {
    std::string_view word;
    std::size_t most;
    glm::vec3 initial;  ///< defaults of the numeric arguments
    /// Applies the option. Returns false if the option changes the texture but is not supported.
    /// The pointer is null for options without a visible effect.
    bool (*set)(MeshMap& map, const glm::vec3& value, std::string_view text);
};

constexpr MapOption kMapOptions[] = {
    {"-s", 3, glm::vec3(1),
     [](MeshMap& map, const glm::vec3& v, std::string_view) {
         map.scale = v;
         return true;
     }},
    {"-o", 3, glm::vec3(0),
     [](MeshMap& map, const glm::vec3& v, std::string_view) {
         map.offset = v;
         return true;
     }},
    {"-bm", 1, glm::vec3(0),
     [](MeshMap& map, const glm::vec3& v, std::string_view) {
         map.strength = v.x;
         return true;
     }},
    {"-clamp", 0, glm::vec3(0),
     [](MeshMap& map, const glm::vec3&, std::string_view text) {
         map.clamp = text == "on";
         return true;
     }},
    {"-t", 3, glm::vec3(0),
     [](MeshMap&, const glm::vec3& v, std::string_view) { return v == glm::vec3(0); }},
    {"-mm", 2, glm::vec3(0, 1, 0),
     [](MeshMap&, const glm::vec3& v, std::string_view) { return v == glm::vec3(0, 1, 0); }},
    {"-cc", 0, glm::vec3(0),
     [](MeshMap&, const glm::vec3&, std::string_view text) { return text == "off"; }},
    {"-imfchan", 0, glm::vec3(0),
     [](MeshMap&, const glm::vec3&, std::string_view text) { return text == "l" || text == "r"; }},
    {"-colorspace", 0, glm::vec3(0),
     [](MeshMap&, const glm::vec3&, std::string_view text) { return text == "sRGB"; }},
    {"-boost", 1, glm::vec3(0), nullptr},
    {"-texres", 1, glm::vec3(0), nullptr},
    {"-blendu", 0, glm::vec3(0), nullptr},
    {"-blendv", 0, glm::vec3(0), nullptr},
    {"-type", 0, glm::vec3(0), nullptr},
};

/// Statements without effect in physically based shading. Ambient light comes from the environment,
/// and highlights from the dielectric or metallic surface; the other statements control reflection,
/// refraction and filtering in a renderer of 1995.
constexpr std::string_view kWithoutEffect[] = {"ka",     "ks",        "ni",     "illum",
                                               "map_ka", "sharpness", "map_aat"};

/// Parses a texture statement: options, then a name, which may contain blanks.
MeshMap mapIn(std::string_view text, const std::string& where) {
    MeshMap map;
    map.where = where;
    while (true) {
        text = trimmed(text);
        std::string_view rest = text;
        const std::string_view word = takeWord(rest);
        const auto* const option = std::ranges::find(kMapOptions, word, &MapOption::word);
        if (option == std::end(kMapOptions)) break;
        // A single number sets only the first component; the others keep their defaults.
        glm::vec3 value = option->initial;
        std::string_view argument;
        if (option->most == 0) argument = takeWord(rest);
        for (std::size_t i = 0; i < option->most; ++i) {
            std::string_view after = rest;
            const auto number = numberIn<float>(takeWord(after));
            if (!number || !std::isfinite(*number)) break;
            value[static_cast<int>(i)] = *number;
            rest = after;
        }
        if (option->set && !option->set(map, value, argument)) map.lost.emplace_back(word);
        text = rest;
    }
    map.file = objName(text);
    return map;
}

/// Returns the file names in an `mtllib` statement. Blanks may separate names, or be part of a
/// name.
std::vector<std::string> libraryNames(std::string_view text) {
    constexpr std::string_view kEnd = ".mtl";
    std::vector<std::string> names;
    for (text = objName(text); !text.empty(); text = trimmed(text)) {
        std::size_t end = text.size();
        if (text.front() == '"') {
            end = std::min(text.find('"', 1), end - 1) + 1;
        } else {
            const std::string small = lowerCase(text);
            for (std::size_t at = small.find(kEnd); at < end; at = small.find(kEnd, at + 1))
                if (at + kEnd.size() < end && isBlank(text[at + kEnd.size()]))
                    end = at + kEnd.size();
        }
        names.emplace_back(text.substr(0, end));
        text.remove_prefix(end);
    }
    return names;
}

}  // namespace

std::string_view objName(std::string_view text) {
    return trimmed(text.substr(0, text.find(" # ")));
}

void ObjMaterials::Fault::add(const Mtl& mtl) {
    if (count++ == 0) first = mtl.name;
}

ObjMaterials::ObjMaterials(MeshFile& file) : file_(file), textures_(file) {}
ObjMaterials::~ObjMaterials() = default;

void ObjMaterials::load(std::string_view names, const std::string& where) {
    for (const std::string& name : libraryNames(names)) {
        // Programs repeat the statement for every object, so skip files that have been read.
        if (!libraries_.insert(name).second) continue;
        try {
            const std::vector<std::uint8_t> bytes = file_.readBeside(name, {}, where);
            read(name, {reinterpret_cast<const char*>(bytes.data()), bytes.size()});
        } catch (const Error& problem) {
            if (problem.where() != where) throw;  // rethrow: the file exists but is faulty
            file_.missing("The materials \"" + name + "\" are left out", problem, where);
        }
    }
}

void ObjMaterials::read(const std::string& name, std::string_view text) {
    static constexpr MapRow<Mtl> kMaps[] = {
        {"map_kd", &Mtl::diffuse_map},  {"map_d", &Mtl::opacity_map},
        {"map_ke", &Mtl::emissive_map}, {"map_pr", &Mtl::roughness_map},
        {"map_pm", &Mtl::metallic_map}, {"norm", &Mtl::normal_map},
        {"map_norm", &Mtl::normal_map},
    };
    const std::string folder = file_.folderOf(name);
    text = withoutByteOrderMark(text);
    for (std::size_t line = 1; !text.empty(); ++line) {
        std::string_view rest = takeLine(text);
        const std::string word = lowerCase(takeWord(rest));
        const std::string where = name + ":" + std::to_string(line);
        if (word.empty() || word.front() == '#') continue;
        if (word == "newmtl") {
            file_.allow(sizeof(Mtl) + rest.size());
            Mtl& mtl = materials_.emplace_back();
            mtl.name = objName(rest);
            if (!numbers_.try_emplace(mtl.name, static_cast<int>(materials_.size()) - 1).second)
                file_.warn("The material \"" + mtl.name + "\" appears twice; the first is used.",
                           where);
            continue;
        }
        if (materials_.empty()) {
            file_.warn("Lines before the first newmtl of \"" + name + "\" are ignored.", where);
            continue;
        }
        Mtl& mtl = materials_.back();
        if (const auto* const map = std::ranges::find(kMaps, word, &MapRow<Mtl>::word);
            map != std::end(kMaps)) {
            MeshMap& read = mtl.*map->map = mapIn(rest, where);
            read.from = folder;
            for (const std::string& option : read.lost)
                lose(mtl, "The option " + option + " of textures is ignored.", where);
        } else if (word == "bump" || word == "map_bump") {
            lose(mtl, "Height maps (bump, map_Bump) are not read.", where);
        } else if (!readNumbers(mtl, word, rest, where) &&
                   std::ranges::find(kWithoutEffect, word) == std::end(kWithoutEffect)) {
            lose(mtl, "The statement " + word + " of materials is not read.", where);
        }
    }
}

/// Keeps a warning until the material is used.
void ObjMaterials::lose(Mtl& mtl, const std::string& sentence, const std::string& where) {
    constexpr std::size_t kMost = 20;
    if (mtl.lost.size() >= kMost) return;
    file_.allow(sizeof mtl.lost[0] + sentence.size() + where.size());
    mtl.lost.emplace_back(sentence, where);
}

/// Reads a numeric statement. Returns false if `word` is not the keyword of such a statement.
bool ObjMaterials::readNumbers(Mtl& mtl, std::string_view word, std::string_view rest,
                               const std::string& where) {
    constexpr float kAny = std::numeric_limits<float>::max();
    static constexpr NumberRow<Mtl> kNumbers[] = {
        {"kd", 3, 0, 1, [](Mtl& m, const glm::vec3& v) { m.diffuse = v; }},
        {"ke", 3, 0, kAny, [](Mtl& m, const glm::vec3& v) { m.emissive = v; }},
        {"tf", 3, -kAny, kAny, [](Mtl& m, const glm::vec3& v) { m.filter = v; }},
        {"d", 1, 0, 1, [](Mtl& m, const glm::vec3& v) { m.dissolve = v.x; }},
        {"tr", 1, 0, 1, [](Mtl& m, const glm::vec3& v) { m.transparency = v.x; }},
        {"ns", 1, 0, kAny, [](Mtl& m, const glm::vec3& v) { m.shininess = v.x; }},
        {"pr", 1, 0, 1, [](Mtl& m, const glm::vec3& v) { m.roughness = v.x; }},
        {"pm", 1, 0, 1, [](Mtl& m, const glm::vec3& v) { m.metallic = v.x; }},
        {"ps", 1, 0, 1, [](Mtl& m, const glm::vec3& v) { m.sheen = v.x; }},
        {"pc", 1, 0, 1, [](Mtl& m, const glm::vec3& v) { m.clearcoat = v.x; }},
        {"pcr", 1, 0, 1, [](Mtl& m, const glm::vec3& v) { m.clearcoat_roughness = v.x; }},
        {"aniso", 1, 0, 1, [](Mtl& m, const glm::vec3& v) { m.anisotropy = v.x; }},
        {"anisor", 1, -kAny, kAny, [](Mtl& m, const glm::vec3& v) { m.anisotropy_turn = v.x; }},
    };
    const auto* const row = std::ranges::find(kNumbers, word, &NumberRow<Mtl>::word);
    if (row == std::end(kNumbers)) return false;
    rest = rest.substr(0, rest.find('#'));
    glm::vec3 value(0);
    for (std::size_t i = 0; i < row->count; ++i) {
        std::string_view text = takeWord(rest);
        if (text == "-halo") {
            lose(mtl, "The option -halo of d is ignored.", where);
            text = takeWord(rest);
        }
        if (text == "spectral" || text == "xyz") {
            lose(mtl, "Spectral and xyz colours are not read.", where);
            return true;
        }
        const auto read = numberIn<float>(text);
        if (read && std::isfinite(*read)) {
            value[static_cast<int>(i)] = *read;
        } else if (i == 1 && text.empty()) {  // a single number means grey
            value = glm::vec3(value.x);
            break;
        } else {
            throw Error(ErrorKind::kInput,
                        "expected a number, not \"" + std::string(text.substr(0, 32)) + "\"", where,
                        "export the materials again");
        }
    }
    const glm::vec3 clamped = glm::clamp(value, row->least, row->most);
    if (clamped != value)
        lose(mtl,
             "Numbers of materials that are out of range (" + std::string(word) + ") are clamped.",
             where);
    row->set(mtl, clamped);
    return true;
}

int ObjMaterials::use(const std::string& material, const std::string& where) {
    const auto [found, is_new] = numbers_.try_emplace(material, -1);
    if (is_new)
        file_.warn("The material \"" + material + "\" is missing (" + where +
                   "); it is shown as neutral grey.");
    if (found->second < 0) return -1;
    materials_[static_cast<std::size_t>(found->second)].used = true;
    return found->second;
}

/// Returns a material's opacity. `d` takes precedence over `Tr`, because programs disagree about
/// `Tr`: some write the same value for both, others values that add up to 1.
float ObjMaterials::opacity(const Mtl& mtl) {
    constexpr float kRounded = 0.01F;
    const float by_transparency = 1 - mtl.transparency.value_or(0);
    const float opacity = mtl.dissolve.value_or(by_transparency);
    if (!mtl.used) return opacity;
    if (mtl.transparency && std::abs(opacity - by_transparency) > kRounded) contradictory_.add(mtl);
    if (opacity <= 0) invisible_.add(mtl);
    return opacity;
}

void ObjMaterials::useWithoutTexcoords(int material) {
    if (material >= 0) materials_[static_cast<std::size_t>(material)].without_texcoords = true;
}

Material ObjMaterials::material(const Mtl& mtl) {
    // For a material with only a texture, exporters write a black diffuse colour.
    const bool black = mtl.diffuse_map && mtl.diffuse == glm::vec3(0);
    const glm::vec3 diffuse = black ? glm::vec3(1) : mtl.diffuse;
    Material material = plainMaterial(mtl.name, glm::vec4(diffuse, opacity(mtl)));
    // The square root of the width of a microfacet distribution with this Blinn-Phong exponent (B.
    // Walter et al., "Microfacet Models for Refraction through Rough Surfaces", 2007, section 5.2).
    material.roughness = mtl.roughness.value_or(std::pow(2 / (mtl.shininess + 2), 0.25F));
    material.metallic = mtl.metallic;
    material.emissive = mtl.emissive;
    material.sheen.color = glm::vec3(mtl.sheen);
    material.clearcoat.factor = mtl.clearcoat;
    material.clearcoat.roughness = mtl.clearcoat_roughness;
    material.anisotropy.strength = mtl.anisotropy;
    material.anisotropy.rotation = 2 * std::numbers::pi_v<float> * mtl.anisotropy_turn;
    if (!mtl.used) return material;  // the textures of an unused material may be missing
    for (const auto& [sentence, where] : mtl.lost)
        file_.warn(sentence, where);
    if (mtl.filter != glm::vec3(mtl.filter.x)) tinted_.add(mtl);
    if (mtl.without_texcoords && (mtl.diffuse_map || mtl.opacity_map || mtl.emissive_map ||
                                  mtl.roughness_map || mtl.metallic_map || mtl.normal_map))
        unplaced_.add(mtl);
    if (mtl.opacity_map && mtl.opacity_map.file != mtl.diffuse_map.file)
        material.base_color_texture = textures_.combined({{{&mtl.diffuse_map, 0},
                                                           {&mtl.diffuse_map, 1},
                                                           {&mtl.diffuse_map, 2},
                                                           {&mtl.opacity_map, 0}}});
    else
        material.base_color_texture = textures_.texture(mtl.diffuse_map);
    if (material.base_color.a < 1 || mtl.opacity_map) material.alpha_mode = AlphaMode::kBlend;
    if (mtl.roughness_map || mtl.metallic_map) {
        material.metallic_roughness_texture = textures_.combined(
            {{{nullptr, 0}, {&mtl.roughness_map, 0}, {&mtl.metallic_map, 0}, {nullptr, 0}}});
        // If there is a map but no factor, the factor is 1.
        if (mtl.roughness_map && !mtl.roughness) material.roughness = 1;
        if (mtl.metallic_map && mtl.metallic == 0) material.metallic = 1;
    }
    material.emissive_texture = textures_.texture(mtl.emissive_map);
    if (mtl.emissive_map && mtl.emissive == glm::vec3(0)) material.emissive = glm::vec3(1);
    material.normal_texture = textures_.texture(mtl.normal_map);
    material.normal_scale = mtl.normal_map.strength;
    return material;
}

void ObjMaterials::warnOf(const Fault& fault, const std::string& what, const std::string& more) {
    if (fault.count > 0)
        file_.warn(what + " (" + std::to_string(fault.count) +
                   (fault.count == 1 ? " material" : " materials") + "; the first: \"" +
                   fault.first + "\")" + more);
}

void ObjMaterials::finish() {
    for (const Mtl& mtl : materials_)
        file_.scene().materials.push_back(material(mtl));
    warnOf(contradictory_, "Materials have d and Tr that contradict each other", "; d is used.");
    warnOf(invisible_, "Materials are fully transparent", ": they are invisible.");
    warnOf(unplaced_, "Faces without texture coordinates have materials with textures",
           ": these faces show a single texel.");
    warnOf(tinted_, "The filters (Tf) of materials are not read", ".");
}

}  // namespace peeler
