// SPDX-License-Identifier: Apache-2.0
// Materials of Wavefront's MTL (Alias|Wavefront, "MTL material format", 1995) with the extension
// for physically based ones (Clara.io, "Extending Wavefront MTL for Physically-Based").
#include <algorithm>
#include <cmath>
#include <numbers>
#include <string_view>

#include "core/base/error.h"
#include "formats/file/text_words.h"
#include "formats/meshes/mesh_parts.h"

namespace peeler {

struct ObjMaterials::Mtl {
    std::string name;
    glm::vec3 diffuse{1}, emissive{0};
    float opacity = 1;
    float shininess = 0;               ///< exponent of Phong's highlight
    std::optional<float> roughness{};  ///< in place of it
    float metallic = 0, sheen = 0, clearcoat = 0, clearcoat_roughness = 0;
    float anisotropy = 0, anisotropy_turn = 0;  ///< the second in whole turns
    MeshMap diffuse_map, opacity_map, emissive_map, roughness_map, metallic_map, normal_map;
    bool used = false;
};

namespace {

/// What a statement sets, of the numbers behind it.
template <class Mtl>
struct NumberRow {
    std::string_view word;
    std::size_t count;
    void (*set)(Mtl& mtl, const glm::vec3& value);
};

template <class Mtl>
struct MapRow {
    std::string_view word;
    MeshMap Mtl::*map;
};

/// An option before the name of a texture, and how many numbers or words follow it at most.
struct MapOption {
    std::string_view word;
    std::size_t most;
    void (*set)(MeshMap& map, const glm::vec3& value, std::string_view text);
};

constexpr MapOption kMapOptions[] = {
    {"-s", 3, [](MeshMap& map, const glm::vec3& v, std::string_view) { map.scale = v; }},
    {"-o", 3, [](MeshMap& map, const glm::vec3& v, std::string_view) { map.offset = v; }},
    {"-bm", 1, [](MeshMap& map, const glm::vec3& v, std::string_view) { map.strength = v.x; }},
    {"-clamp", 0,
     [](MeshMap& map, const glm::vec3&, std::string_view text) { map.clamp = text == "on"; }},
    {"-t", 3, nullptr},
    {"-mm", 2, nullptr},
    {"-boost", 1, nullptr},
    {"-texres", 1, nullptr},
    {"-blendu", 0, nullptr},
    {"-blendv", 0, nullptr},
    {"-cc", 0, nullptr},
    {"-imfchan", 0, nullptr},
    {"-type", 0, nullptr},
    {"-colorspace", 0, nullptr},
};

std::string lower(std::string_view text) {
    std::string result(text);
    for (char& c : result)
        if (c >= 'A' && c <= 'Z') c = static_cast<char>(c - 'A' + 'a');
    return result;
}

/// A texture's statement: options, then a name, which may have blanks in it.
MeshMap mapIn(std::string_view text, const std::string& where) {
    MeshMap map;
    map.where = where;
    while (true) {
        text = trimmed(text);
        std::string_view rest = text;
        const std::string_view word = takeWord(rest);
        const auto* const option = std::ranges::find(kMapOptions, word, &MapOption::word);
        if (option == std::end(kMapOptions)) break;
        // One number of three stands for itself alone, the others keep their defaults.
        glm::vec3 value(option->word == "-s" ? 1.0F : 0.0F);
        std::string_view argument;
        if (option->most == 0) argument = takeWord(rest);
        for (std::size_t i = 0; i < option->most; ++i) {
            std::string_view after = rest;
            const auto number = numberIn<float>(takeWord(after));
            if (!number || !std::isfinite(*number)) break;
            value[static_cast<int>(i)] = *number;
            rest = after;
        }
        if (option->set) option->set(map, value, argument);
        text = rest;
    }
    map.file = text;
    std::ranges::replace(map.file, '\\', '/');
    return map;
}

}  // namespace

ObjMaterials::ObjMaterials(MeshFile& file) : file_(file), textures_(file) {}
ObjMaterials::~ObjMaterials() = default;

void ObjMaterials::load(std::string_view names, const std::string& where) {
    std::vector<std::string> files;
    // Names have blanks in them, or between them.
    std::string whole(trimmed(names));
    std::ranges::replace(whole, '\\', '/');
    std::error_code failure;
    const auto path = file_.folder().findFile(whole);
    if (path && std::filesystem::is_regular_file(*path, failure)) {
        files.push_back(whole);
    } else {
        std::string_view rest = whole;
        for (std::string_view word = takeWord(rest); !word.empty(); word = takeWord(rest))
            files.emplace_back(word);
    }
    for (const std::string& name : files) {
        try {
            const std::vector<std::uint8_t> bytes = file_.readBeside(name, where);
            read(name, {reinterpret_cast<const char*>(bytes.data()), bytes.size()});
        } catch (const Error& problem) {
            if (problem.where() != where) throw;  // what is in it is wrong
            file_.missing("The materials \"" + name + "\" are left out", problem, where);
        }
    }
}

void ObjMaterials::read(const std::string& name, std::string_view text) {
    static constexpr NumberRow<Mtl> kNumbers[] = {
        {"kd", 3, [](Mtl& mtl, const glm::vec3& v) { mtl.diffuse = v; }},
        {"ke", 3, [](Mtl& mtl, const glm::vec3& v) { mtl.emissive = v; }},
        {"d", 1, [](Mtl& mtl, const glm::vec3& v) { mtl.opacity = v.x; }},
        {"tr", 1, [](Mtl& mtl, const glm::vec3& v) { mtl.opacity = 1 - v.x; }},
        {"ns", 1, [](Mtl& mtl, const glm::vec3& v) { mtl.shininess = v.x; }},
        {"pr", 1, [](Mtl& mtl, const glm::vec3& v) { mtl.roughness = v.x; }},
        {"pm", 1, [](Mtl& mtl, const glm::vec3& v) { mtl.metallic = v.x; }},
        {"ps", 1, [](Mtl& mtl, const glm::vec3& v) { mtl.sheen = v.x; }},
        {"pc", 1, [](Mtl& mtl, const glm::vec3& v) { mtl.clearcoat = v.x; }},
        {"pcr", 1, [](Mtl& mtl, const glm::vec3& v) { mtl.clearcoat_roughness = v.x; }},
        {"aniso", 1, [](Mtl& mtl, const glm::vec3& v) { mtl.anisotropy = v.x; }},
        {"anisor", 1, [](Mtl& mtl, const glm::vec3& v) { mtl.anisotropy_turn = v.x; }},
    };
    static constexpr MapRow<Mtl> kMaps[] = {
        {"map_kd", &Mtl::diffuse_map},  {"map_d", &Mtl::opacity_map},
        {"map_ke", &Mtl::emissive_map}, {"map_pr", &Mtl::roughness_map},
        {"map_pm", &Mtl::metallic_map}, {"norm", &Mtl::normal_map},
        {"map_norm", &Mtl::normal_map},
    };
    const std::string folder = name.substr(0, name.rfind('/') + 1);
    text = withoutByteOrderMark(text);
    for (std::size_t line = 1; !text.empty(); ++line) {
        std::string_view rest = takeLine(text);
        const std::string word = lower(takeWord(rest));
        const std::string where = name + ":" + std::to_string(line);
        if (word == "newmtl") {
            file_.allow(sizeof(Mtl) + rest.size());
            Mtl& mtl = materials_.emplace_back();
            mtl.name = trimmed(rest);
            numbers_.try_emplace(mtl.name, static_cast<int>(materials_.size()) - 1);
            continue;
        }
        if (materials_.empty()) continue;
        Mtl& mtl = materials_.back();
        const auto* const map = std::ranges::find(kMaps, word, &MapRow<Mtl>::word);
        if (map != std::end(kMaps)) {
            mtl.*map->map = mapIn(rest, where);
            if (mtl.*map->map && (mtl.*map->map).file.front() != '/')
                (mtl.*map->map).file.insert(0, folder);
        }
        if (word == "bump" || word == "map_bump")
            file_.warn("Height maps (bump, map_Bump) are not read.");
        const auto* const number = std::ranges::find(kNumbers, word, &NumberRow<Mtl>::word);
        if (number == std::end(kNumbers)) continue;
        glm::vec3 value(0);
        for (std::size_t i = 0; i < number->count; ++i) {
            std::string_view text_of = takeWord(rest);
            if (text_of == "-halo") text_of = takeWord(rest);
            if (text_of == "spectral" || text_of == "xyz") {
                file_.warn("Colours that are spectral or xyz are not read.");
                break;
            }
            const auto read = numberIn<float>(text_of);
            if (read && std::isfinite(*read)) {
                value[static_cast<int>(i)] = *read;
            } else if (i == 1 && text_of.empty()) {  // one number is a grey
                value = glm::vec3(value.x);
                break;
            } else {
                throw Error(ErrorKind::kInput,
                            "expected a number, not \"" + std::string(text_of.substr(0, 32)) + "\"",
                            where, "export the materials again");
            }
        }
        number->set(mtl, value);
    }
}

int ObjMaterials::use(const std::string& material, const std::string& where) {
    const auto [found, is_new] = numbers_.try_emplace(material, -1);
    if (is_new)
        file_.warn("The material \"" + material + "\" is not there (" + where +
                   "); it is a neutral grey.");
    if (found->second < 0) return -1;
    materials_[static_cast<std::size_t>(found->second)].used = true;
    return found->second;
}

Material ObjMaterials::material(const Mtl& mtl) {
    const auto share = [](float value) { return std::clamp(value, 0.0F, 1.0F); };
    // Exporters write black beside a texture and mean the texture alone.
    const bool black = mtl.diffuse_map && mtl.diffuse == glm::vec3(0);
    const glm::vec3 diffuse = black ? glm::vec3(1) : glm::clamp(mtl.diffuse, 0.0F, 1.0F);
    Material material = plainMaterial(mtl.name, glm::vec4(diffuse, share(mtl.opacity)));
    // The exponent of Blinn and Phong as the width of a microfacet distribution (B. Walter et al.,
    // "Microfacet Models for Refraction through Rough Surfaces", 2007, section 5.2); glTF's
    // roughness is its root.
    const float exponent = std::max(mtl.shininess, 0.0F);
    material.roughness = share(mtl.roughness.value_or(std::pow(2 / (exponent + 2), 0.25F)));
    material.metallic = share(mtl.metallic);
    material.emissive = glm::max(mtl.emissive, 0.0F);
    material.sheen.color = glm::vec3(share(mtl.sheen));
    material.clearcoat.factor = share(mtl.clearcoat);
    material.clearcoat.roughness = share(mtl.clearcoat_roughness);
    material.anisotropy.strength = share(mtl.anisotropy);
    material.anisotropy.rotation = 2 * std::numbers::pi_v<float> * mtl.anisotropy_turn;
    if (!mtl.used) return material;  // its textures need not be there
    if (mtl.opacity_map && mtl.opacity_map.file != mtl.diffuse_map.file)
        material.base_color_texture = textures_.combined({{{&mtl.diffuse_map, 0},
                                                           {&mtl.diffuse_map, 1},
                                                           {&mtl.diffuse_map, 2},
                                                           {&mtl.opacity_map, 0}}});
    else
        material.base_color_texture = textures_.texture(mtl.diffuse_map);
    if (mtl.opacity < 1 || mtl.opacity_map) material.alpha_mode = AlphaMode::kBlend;
    if (mtl.roughness_map || mtl.metallic_map) {
        material.metallic_roughness_texture = textures_.combined(
            {{{nullptr, 0}, {&mtl.roughness_map, 0}, {&mtl.metallic_map, 0}, {nullptr, 0}}});
        // A map without a number is the number.
        if (mtl.roughness_map && !mtl.roughness) material.roughness = 1;
        if (mtl.metallic_map && mtl.metallic == 0) material.metallic = 1;
    }
    material.emissive_texture = textures_.texture(mtl.emissive_map);
    if (mtl.emissive_map && mtl.emissive == glm::vec3(0)) material.emissive = glm::vec3(1);
    material.normal_texture = textures_.texture(mtl.normal_map);
    material.normal_scale = mtl.normal_map.strength;
    return material;
}

void ObjMaterials::finish() {
    for (const Mtl& mtl : materials_)
        file_.scene().materials.push_back(material(mtl));
}

}  // namespace peeler
