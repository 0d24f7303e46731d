// SPDX-License-Identifier: Apache-2.0
#include "cmd/options/appearance_options.h"

#include "cmd/cli/arguments.h"
#include "cmd/cli/parse.h"
#include "cmd/session/choices.h"

namespace peeler::cmd {

namespace {

constexpr Choice<Transmitted> kTransmissions[] = {
    {"color", Transmitted::kColor,
     "their layers filter the layers behind them per colour channel, without refraction; layers "
     "get AR, AG and AB besides A if the scene has coloured glass"},
    {"alpha", Transmitted::kAlpha,
     "their layers have a single alpha, which attenuates all colours behind them equally"},
    {"opaque", Transmitted::kNothing, "they are drawn as opaque"},
};

void addVariantOption(VerbOptions& verb, AppearanceOptions& appearance, const std::string& remark) {
    addValue(
        verb, "--variant", "NAME|INDEX", appearance.variant,
        [](const std::string& text) { return text; },
        "material variant of the file (KHR_materials_variants); peeler info lists them (default: "
        "the meshes' own materials)" +
            remark)
        .group("Scene");
}

void addEnvironmentOptions(VerbOptions& verb, AppearanceOptions& appearance,
                           const std::string& remark) {
    addFile(verb, "--environment", "FILE|studio|none", appearance.environment,
            "environment light: an equirectangular .hdr or .exr with its centre at +Z, studio "
            "(soft boxes in a dim room), or none" +
                remark)
        .files(".hdr .exr")
        .group("Light");
    addValue(
        verb, "--environment-rotation", "DEGREES", appearance.environment_rotation,
        [](const std::string& text) { return parseNumber(text); },
        "rotate the environment about +Y; 90 turns +Z to +X (default: 0)")
        .group("Light");
}

}  // namespace

void addVariantOption(VerbOptions& verb, AppearanceOptions& appearance) {
    addVariantOption(verb, appearance, "");
}

void addAppearanceOptions(VerbOptions& verb, AppearanceOptions& appearance) {
    addVariantOption(verb, appearance);
    addChoice<Transmitted>(verb, "--transmission", appearance.transmission, kTransmissions,
                           "transmission",
                           "treatment of glass and other surfaces that transmit light:")
        .group("Layers");
    addEnvironmentOptions(verb, appearance);
}

void addEnvironmentOptions(VerbOptions& verb, AppearanceOptions& appearance) {
    addEnvironmentOptions(verb, appearance,
                          "; it replaces the built-in light, but neither the scene's lights nor "
                          "the background (default: studio in display formats if the scene has no "
                          "lights and --shadows is not given, else none)");
}

void addBakedAppearanceOptions(VerbOptions& verb, AppearanceOptions& appearance) {
    addVariantOption(verb, appearance, "; a .glb output shows it by default");
    addEnvironmentOptions(verb, appearance, "; only --quantity irradiance uses it (default: none)");
}

}  // namespace peeler::cmd
