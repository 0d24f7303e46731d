// SPDX-License-Identifier: Apache-2.0
#include "cmd/options/appearance_options.h"

#include "cmd/cli/arguments.h"
#include "cmd/cli/parse.h"
#include "cmd/session/choices.h"

namespace peeler::cmd {

namespace {

constexpr Choice<Transmitted> kTransmissions[] = {
    {"color", Transmitted::kColor,
     "its layer filters what is behind it colour by colour, unrefracted: layers have AR, AG and AB "
     "beside A, if anything in the scene is coloured glass"},
    {"alpha", Transmitted::kAlpha, "its layer has one alpha, and veils what is behind it"},
    {"opaque", Transmitted::kNothing, "it is shown as if it let no light through"},
};

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

}  // namespace peeler::cmd
