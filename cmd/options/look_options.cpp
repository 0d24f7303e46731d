// SPDX-License-Identifier: Apache-2.0
#include "cmd/options/look_options.h"

#include <cmath>
#include <nlohmann/json.hpp>
#include <numbers>
#include <string_view>
#include <vector>

#include "cmd/cli/arguments.h"
#include "cmd/cli/choices.h"
#include "cmd/cli/parse.h"
#include "cmd/cli/report.h"
#include "core/base/error.h"
#include "formats/file/content_hash.h"
#include "formats/image/environment_file.h"

namespace peeler::cmd {

namespace {

// The value: whether light passes.
constexpr Choice<bool> kTransmissions[] = {
    {"alpha", true, "its layer lets through what it transmits, unrefracted"},
    {"opaque", false, "it is shown as if it let no light through"},
};

std::size_t variantNamed(const Scene& scene, const std::string& text) {
    std::vector<std::vector<std::string>> names;
    for (const std::string& name : scene.variants)
        names.push_back({name});
    if (const auto found = findNameOrIndex(text, names)) return *found;
    std::string hint =
        choiceHint(text, "variants",
                   std::vector<std::string_view>(scene.variants.begin(), scene.variants.end()));
    if (!names.empty()) hint += "; or an index from 0 to " + std::to_string(names.size() - 1);
    throw Error(ErrorKind::kUsage, "unknown variant", "--variant " + text, hint);
}

/// Whole turns taken off, so that a rotation by 360 degrees is none.
double turn(const LookOptions& look) {
    return std::remainder(look.environment_rotation.value_or(0), 360.0);
}

void addVariantOption(VerbOptions& verb, LookOptions& look, const std::string& remark) {
    addValue(
        verb, "--variant", "NAME|INDEX", look.variant, [](const std::string& text) { return text; },
        "which of the file's materials (KHR_materials_variants) to show; peeler info lists them "
        "(default: none, the materials of the meshes themselves)" +
            remark)
        .group("Scene");
}

void addEnvironmentOptions(VerbOptions& verb, LookOptions& look, const std::string& remark) {
    addValue(
        verb, "--environment", "FILE", look.environment,
        [](const std::string& text) { return std::filesystem::path(text); },
        "light from all around: an equirectangular .hdr or .exr, its centre seen along +Z" + remark)
        .group("Light");
    addValue(
        verb, "--environment-rotation", "DEGREES", look.environment_rotation,
        [](const std::string& text) { return parseNumber(text); },
        "turns the environment about +Y; 90 takes what is seen along +Z to +X (default: 0)")
        .group("Light");
}

}  // namespace

void addVariantOption(VerbOptions& verb, LookOptions& look) {
    addVariantOption(verb, look, "");
}

void addLookOptions(VerbOptions& verb, LookOptions& look) {
    addVariantOption(verb, look);
    addChoice<bool>(verb, "--transmission", look.transmission, kTransmissions, "transmission",
                    "glass and other surfaces that transmit light:")
        .group("Layers");
    addEnvironmentOptions(verb, look,
                          ". It is light only; the background stays what --background says. The "
                          "built-in light is off then, the scene's own lights shine on");
}

void addBakedLookOptions(VerbOptions& verb, LookOptions& look) {
    addVariantOption(verb, look, "; a .glb opens with them, too");
    addEnvironmentOptions(verb, look, "; irradiance");
}

std::optional<std::size_t> chosenVariant(const Scene& scene, const LookOptions& look) {
    if (!look.variant) return {};
    return variantNamed(scene, *look.variant);
}

void checkLookOptions(const LookOptions& look) {
    if (look.environment_rotation && !look.environment)
        throw Error(ErrorKind::kUsage, "there is no environment to turn", "--environment-rotation",
                    "add --environment FILE");
}

Scene loadScene(const std::filesystem::path& path, GltfOptions gltf, const LookOptions& look,
                bool shadows) {
    gltf.transmission = look.transmission;
    Scene scene = readGltf(path, gltf);
    if (const auto variant = chosenVariant(scene, look)) chooseVariant(scene, *variant);
    if (!look.environment) return scene;
    scene.environment = readEnvironment(look.environment->string());
    scene.environment->rotation = turn(look) * std::numbers::pi / 180;
    if (shadows && scene.lights.empty())
        scene.warnings.push_back("The environment is the only light, and it casts no shadows.");
    return scene;
}

nlohmann::json lookSettings(const LookOptions& look, const Scene& scene) {
    nlohmann::json settings = nlohmann::json::object();
    if (const auto variant = chosenVariant(scene, look)) settings["variant"] = *variant;
    if (!look.transmission) settings["transmission"] = "opaque";
    if (!scene.environment) return settings;
    settings["environment"] = hexText(scene.environment->content_hash);
    settings["environmentRotation"] = turn(look);
    return settings;
}

}  // namespace peeler::cmd
