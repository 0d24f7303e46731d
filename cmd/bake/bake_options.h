// SPDX-License-Identifier: Apache-2.0
// The options of peeler bake.
#pragma once

#include <filesystem>
#include <nlohmann/json_fwd.hpp>
#include <optional>
#include <span>
#include <string>
#include <string_view>
#include <vector>

#include <peeler/capture_settings.h>
#include "cmd/options/scene_options.h"
#include "cmd/session/choices.h"
#include "core/bake/bake.h"
#include "core/bake/receivers.h"
#include "core/scene/posed_scene.h"
#include "formats/exr/texture_files.h"

namespace peeler::cmd {

class VerbOptions;

// The quantities by name. The first is the default.
inline constexpr Choice<BakeQuantity> kBakeQuantities[] = {
    {"ao", BakeQuantity::kAmbientOcclusion,
     "ambient occlusion: cosine-weighted unoccluded share of the hemisphere"},
    {"bent-normal", BakeQuantity::kBentNormal, "mean unoccluded direction, world space"},
    {"sky-visibility", BakeQuantity::kSkyVisibility,
     "share of the light from a uniform sky above that reaches the surface"},
    {"thickness", BakeQuantity::kThickness, "mean distance to the other side, scene units"},
    {"irradiance", BakeQuantity::kIrradiance,
     "light from the environment and from emissive materials, with diffuse bounces"},
};

enum class BakeTarget { kVertices, kTexture };

/// The kinds of output file, determined by the extension.
enum class BakeFile { kGltf, kExr, kPng, kArrays };

struct BakeOptions {
    std::filesystem::path output;
    bool no_clobber = false, no_mkdir = false;
    bool dry_run = false;
    bool values_alone = false;  ///< write a .glb in which viewers show only the values
    BakeSettings settings;
    std::optional<BakeTarget> target;  ///< default: kTexture for .exr and .png, otherwise kVertices
    /// `size` is in texels per side, `padding` in texels.
    std::optional<int> uv_set, size, padding, bounces;
    Faces faces = Faces::kBoth;

    BakeFile file() const;  ///< throws Error (kUsage) for an unknown extension
    BakeTarget chosenTarget() const;
    TexelSettings texels() const;
    int texelPadding() const { return padding.value_or(8); }
};

/// Declares all options in BakeOptions. `options` must outlive the parse.
void addBakeOptions(VerbOptions& verb, BakeOptions& options);

/// Throws Error (kUsage) if the options contradict each other. Does not need the scene.
void checkBakeOptions(const BakeOptions& options, const AppearanceOptions& appearance);

/// Returns the command-line name of a target: "vertices".
std::string_view targetName(BakeTarget target);

/// Returns the options that change the values or their textures, for the settings hash.
nlohmann::json bakeSettings(const BakeOptions& options);

/// Throws Error (kUsage) if the scene has no light source for irradiance.
void checkBakedLight(const PosedScene& posed);

/// Whether the quantity fits a material's occlusion texture.
bool isOcclusion(BakeQuantity quantity);

}  // namespace peeler::cmd
