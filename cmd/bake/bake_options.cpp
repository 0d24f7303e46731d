// SPDX-License-Identifier: Apache-2.0
#include "cmd/bake/bake_options.h"

#include <algorithm>
#include <nlohmann/json.hpp>

#include "cmd/cli/arguments.h"
#include "cmd/cli/errors.h"
#include "cmd/cli/parse.h"
#include "cmd/options/capture_options.h"
#include "formats/file/file_name.h"

namespace peeler::cmd {

namespace {

constexpr Choice<BakeTarget> kTargets[] = {
    {"vertices", BakeTarget::kVertices,
     "vertex arrays, or a .glb of the scene with COLOR_0 and the exact values in _AO, "
     "_BENT_NORMAL, _SKY_VISIBILITY, _THICKNESS or _IRRADIANCE"},
    {"texture", BakeTarget::kTexture,
     "one texture per material: .exr, .png, arrays, or the materials' occlusion textures in a "
     ".glb"},
};

constexpr Choice<BakeFile> kFiles[] = {
    {".glb", BakeFile::kGltf, ""},
    {".exr", BakeFile::kExr, ""},
    {".png", BakeFile::kPng, ""},
    {".npz", BakeFile::kArrays, ""},
    {".safetensors", BakeFile::kArrays, ""},
};

constexpr int kMostDirections = 1 << 20;
constexpr int kMostResolution = 16384;
// Texels per side; the receivers of a larger texture would take several GiB.
constexpr int kMostTexels = 8192;

int evenNumber(const std::string& text) {
    const auto number = parseInteger(text, 2, kMostDirections);
    if (number % 2 != 0)
        throw Error(ErrorKind::kUsage,
                    "expected an even number: directions come in opposite pairs");
    return static_cast<int>(number);
}

auto integers(int least, int most) {
    return [least, most](const std::string& text) {
        return static_cast<int>(parseInteger(text, least, most));
    };
}

bool showsEmission(const PosedScene& posed) {
    return std::ranges::any_of(posed.meshes(), [&](const MeshInstance& instance) {
        return std::ranges::any_of(posed.primitives(instance), [&](const Primitive& primitive) {
            const Material& material =
                posed.scene().materials[static_cast<std::size_t>(primitive.material)];
            return material.emissive != glm::vec3(0);
        });
    });
}

}  // namespace

bool isOcclusion(BakeQuantity quantity) {
    return quantity == BakeQuantity::kAmbientOcclusion || quantity == BakeQuantity::kSkyVisibility;
}

BakeFile BakeOptions::file() const {
    const std::string extension = lowerExtension(output);
    for (const auto& choice : kFiles)
        if (choice.name == extension) return choice.value;
    refuse("cannot bake into this file format", "--output " + output.string(),
           "choose one of: .glb, .exr, .png, .npz, .safetensors");
}

BakeTarget BakeOptions::chosenTarget() const {
    const bool textures = file() == BakeFile::kExr || file() == BakeFile::kPng;
    return target.value_or(textures ? BakeTarget::kTexture : BakeTarget::kVertices);
}

TexelSettings BakeOptions::texels() const {
    TexelSettings result;
    if (size) result.size = *size;
    if (uv_set) result.uv_set = *uv_set;
    return result;
}

void addBakeOptions(VerbOptions& verb, BakeOptions& options) {
    const auto add = [&](const char* group, const char* name, const char* value, auto& target,
                         auto parse, const std::string& help) {
        return addValue(verb, name, value, target, parse, help).group(group);
    };
    addFile(
        verb, "-o,--output", "FILE", options.output,
        "file to write: .glb (the scene with the baked values), .exr (32-bit floats, one part per "
        "material), .png (16 bits; with several materials one file each: #### or %04d in the name "
        "becomes the material's number), .npz or .safetensors (NumPy arrays, see below)")
        .files(".glb .exr .png .npz .safetensors")
        .group("Output")
        .required();
    verb.addFlag("--no-mkdir", options.no_mkdir,
                 "fail if the file's folder is missing (default: create it)")
        .group("Output");
    verb.addFlag("--no-clobber", options.no_clobber, "fail if the file exists").group("Output");
    addValue(
        verb, "--target", "NAME", options.target,
        [](const std::string& text) {
            return choose(std::string("target"), std::span<const Choice<BakeTarget>>(kTargets),
                          text);
        },
        "where to bake to (default: texture for .exr and .png, else vertices):")
        .oneOf(describeChoices(kTargets))
        .group("Output");
    verb.addFlag("--values-alone", options.values_alone,
                 "give everything in a .glb one white, unlit material, so that viewers show only "
                 "the vertex values")
        .group("Output");
    add("Output", "--uv", "SET", options.uv_set, integers(0, 1),
        "UV set of the textures: 0 or 1 (default: 0)");
    add("Output", "--size", "N", options.size, integers(1, kMostTexels),
        "texels per side of each texture (default: 1024)");
    add("Output", "--padding", "N", options.padding, integers(0, 256),
        "texels by which values are spread beyond a surface's edges in the texture (default: 8)");
    addChoice<BakeQuantity>(verb, "--quantity", options.settings.quantity, kBakeQuantities,
                            "quantity", "quantity to bake:")
        .group("Baking");
    add("Baking", "--directions", "N", options.settings.directions, evenNumber,
        "number of directions over the sphere, an even number (default: 256)");
    add("Baking", "--resolution", "R", options.settings.resolution, integers(1, kMostResolution),
        "rays along the longer side of each bundle, for --engine gl and irradiance; a bundle "
        "covers the scene, and details smaller than the distance between rays are lost (default: "
        "512)");
    add(
        "Baking", "--max-distance", "D", options.settings.max_distance,
        [](const std::string& text) { return parsePositiveOrInfinite(text); },
        "ignore surfaces farther away than this, in scene units (default: inf)");
    add("Baking", "--bounces", "N", options.bounces, integers(0, 64),
        "light bounces between diffuse surfaces, for irradiance (default: 1)");
    addChoice<Faces>(verb, "--faces", options.faces, kRayFaces, "choice of faces",
                     "sides of triangles that rays hit:")
        .group("Baking");
}

void checkBakeOptions(const BakeOptions& options, const AppearanceOptions& appearance) {
    const BakeFile file = options.file();
    const std::string path = options.output.string();
    if (file != BakeFile::kPng && hasFrameToken(path))
        refuse("one file of this format holds all materials, so it takes no number",
               "--output " + path, "remove #### or %04d from the name, or write .png files");
    if (options.values_alone &&
        (file != BakeFile::kGltf || options.chosenTarget() != BakeTarget::kVertices))
        refuse("only vertex values in a .glb can be shown alone", "--values-alone",
               "leave it out, or write a .glb with --target vertices");
    if (options.chosenTarget() == BakeTarget::kVertices) {
        if (file == BakeFile::kExr || file == BakeFile::kPng)
            refuse("vertex values cannot be written to images",
                   "--target vertices, --output " + path,
                   "write a .glb or arrays, or choose --target texture");
        if (options.uv_set || options.size || options.padding)
            refuse("these options apply to textures only", "--uv, --size, --padding",
                   "leave them out, or add --target texture");
    } else if (file == BakeFile::kGltf && !isOcclusion(options.settings.quantity)) {
        refuse("glTF has textures for ao and sky-visibility only",
               "--target texture, --output " + path,
               "choose --target vertices, or write an .exr or .png");
    }
    if (options.settings.quantity == BakeQuantity::kIrradiance) return;
    if (options.bounces)
        refuse("bounces apply to irradiance only", "--bounces",
               "leave it out, or add --quantity irradiance");
    if (appearance.environment)
        refuse("an environment applies to irradiance only", "--environment",
               "leave it out, or add --quantity irradiance");
}

std::string_view targetName(BakeTarget target) {
    return nameOf<BakeTarget>(kTargets, target);
}

nlohmann::json bakeSettings(const BakeOptions& options) {
    const BakeSettings& settings = options.settings;
    nlohmann::json json{{"quantity", nameOf<BakeQuantity>(kBakeQuantities, settings.quantity)},
                        {"target", targetName(options.chosenTarget())},
                        {"directions", settings.directions},
                        {"resolution", settings.resolution},
                        {"maxDistance", settings.max_distance}};  // JSON null if infinite
    if (settings.quantity == BakeQuantity::kIrradiance)
        json["bounces"] = options.bounces.value_or(settings.bounces);
    if (options.values_alone) json["valuesAlone"] = true;
    if (options.chosenTarget() == BakeTarget::kVertices) return json;
    const TexelSettings texels = options.texels();
    json["texels"] = {
        {"size", texels.size}, {"uvSet", texels.uv_set}, {"padding", options.texelPadding()}};
    return json;
}

void checkBakedLight(const PosedScene& posed) {
    if (posed.scene().environment || showsEmission(posed)) return;
    refuse("the scene has no light: no environment and no emissive material",
           "--quantity irradiance",
           posed.lights().empty() ? "add --environment FILE"
                                  : "add --environment FILE; the scene's lights are not baked, "
                                    "because they are not surfaces");
}

}  // namespace peeler::cmd
