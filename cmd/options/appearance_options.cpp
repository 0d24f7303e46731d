// SPDX-License-Identifier: Apache-2.0
// Options of variants, transmission and environments, and the scene they make.
#include "cmd/options/scene_options.h"

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
#include "core/scene/posed_scene.h"
#include "formats/file/content_hash.h"
#include "formats/image/environment_file.h"

namespace peeler::cmd {

namespace {

constexpr Choice<Transmitted> kTransmissions[] = {
    {"color", Transmitted::kColor,
     "its layer filters what is behind it colour by colour, unrefracted: layers have AR, AG and AB "
     "beside A, if anything in the scene is coloured glass"},
    {"alpha", Transmitted::kAlpha, "its layer has one alpha, and veils what is behind it"},
    {"opaque", Transmitted::kNothing, "it is shown as if it let no light through"},
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

/// Of --environment: the scene's own lights alone, or the built-in ones.
constexpr const char* kNoEnvironment = "none";

bool hasEnvironment(const AppearanceOptions& appearance) {
    return appearance.environment && appearance.environment != kNoEnvironment;
}

/// The rotation of the environment in degrees, without whole turns, so that 360 is none.
double turn(const AppearanceOptions& appearance) {
    return std::remainder(appearance.environment_rotation.value_or(0), 360.0);
}

void addVariantOption(VerbOptions& verb, AppearanceOptions& appearance, const std::string& remark) {
    addValue(
        verb, "--variant", "NAME|INDEX", appearance.variant,
        [](const std::string& text) { return text; },
        "which of the file's materials (KHR_materials_variants) to show; peeler info lists them "
        "(default: none, the materials of the meshes themselves)" +
            remark)
        .group("Scene");
}

void addEnvironmentOptions(VerbOptions& verb, AppearanceOptions& appearance,
                           const std::string& remark) {
    addFile(verb, "--environment", "FILE|studio|none", appearance.environment,
            "light from all around: an equirectangular .hdr or .exr, its centre seen along +Z, or "
            "studio, soft boxes in a dim room, or none (default: of pictures for eyes the studio, "
            "if the scene has no lights of its own and nothing is to cast shadows; else none)" +
                remark)
        .files(".hdr .exr")
        .group("Light");
    addValue(
        verb, "--environment-rotation", "DEGREES", appearance.environment_rotation,
        [](const std::string& text) { return parseNumber(text); },
        "turns the environment about +Y; 90 takes what is seen along +Z to +X (default: 0)")
        .group("Light");
}

}  // namespace

void addVariantOption(VerbOptions& verb, AppearanceOptions& appearance) {
    addVariantOption(verb, appearance, "");
}

void addAppearanceOptions(VerbOptions& verb, AppearanceOptions& appearance) {
    addVariantOption(verb, appearance);
    addChoice<Transmitted>(verb, "--transmission", appearance.transmission, kTransmissions,
                           "transmission", "glass and other surfaces that transmit light:")
        .group("Layers");
    addEnvironmentOptions(verb, appearance,
                          ". It is light only; the background stays what --background says. The "
                          "built-in light is off then, the scene's own lights shine on");
}

void addBakedAppearanceOptions(VerbOptions& verb, AppearanceOptions& appearance) {
    addVariantOption(verb, appearance, "; a .glb opens with them, too");
    addEnvironmentOptions(verb, appearance, "; irradiance");
}

std::optional<std::size_t> chosenVariant(const Scene& scene, const AppearanceOptions& appearance) {
    if (!appearance.variant) return {};
    return variantNamed(scene, *appearance.variant);
}

std::optional<std::filesystem::path> environmentFile(const AppearanceOptions& appearance) {
    if (appearance.environment == kStudioName || !hasEnvironment(appearance)) return {};
    return appearance.environment;
}

void checkAppearanceOptions(const AppearanceOptions& appearance) {
    if (appearance.environment_rotation && !hasEnvironment(appearance))
        throw Error(ErrorKind::kUsage, "there is no environment to turn", "--environment-rotation",
                    "add --environment FILE");
}

Scene loadScene(const std::filesystem::path& path, SceneReadOptions reading,
                const AppearanceOptions& appearance, bool shadows) {
    reading.transmission = appearance.transmission != Transmitted::kNothing;
    Scene scene = readSceneFile(path, reading);
    if (const auto variant = chosenVariant(scene, appearance)) chooseVariant(scene, *variant);
    if (!hasEnvironment(appearance)) return scene;
    ReadWarnings warnings(reading.strict, appearance.environment->string());
    scene.environment = environmentNamed(appearance.environment->string(), warnings);
    for (std::string& sentence : warnings.take())
        scene.warnings.push_back(std::move(sentence));
    scene.environment->rotation = turn(appearance) * std::numbers::pi / 180;
    if (shadows && scene.lights.empty()) {
        const std::string why = "the environment is the only light, and it casts no shadows";
        if (reading.strict) throw Error(ErrorKind::kUsage, why, "--shadows");
        scene.warnings.push_back("T" + why.substr(1) + ".");
    }
    return scene;
}

bool wantsTint(const AppearanceOptions& appearance, const PosedScene& posed) {
    return appearance.transmission == Transmitted::kColor && posed.hasTintedGlass();
}

void addStudio(Scene& scene, int scene_index, const AppearanceOptions& appearance) {
    if (!appearance.studio || appearance.environment) return;
    if (!PosedScene(scene, scene_index).lights().empty()) return;
    scene.environment = namedStudio();
}

nlohmann::json appearanceSettings(const AppearanceOptions& appearance, const Scene& scene) {
    nlohmann::json settings = nlohmann::json::object();
    if (const auto variant = chosenVariant(scene, appearance)) settings["variant"] = *variant;
    if (appearance.transmission == Transmitted::kNothing) settings["transmission"] = "opaque";
    if (!scene.environment) return settings;
    settings["environment"] = hexText(scene.environment->content_hash);
    settings["environmentRotation"] = turn(appearance);
    return settings;
}

}  // namespace peeler::cmd
