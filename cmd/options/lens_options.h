// SPDX-License-Identifier: Apache-2.0
// The options for lenses, of verbs that cast rays through them.
#pragma once

#include <cstdint>
#include <optional>
#include <string>
#include <vector>

#include "cmd/options/camera_options.h"
#include "cmd/options/scene_options.h"
#include "cmd/session/reporter.h"
#include "core/scene/posed_scene.h"

namespace peeler::cmd {

class VerbOptions;

struct LensOptions {
    std::optional<std::string> model;
    std::optional<std::vector<double>> coefficients;

    bool isGiven() const { return model || coefficients; }
};

/// Declares --lens and --distortion. `options` must outlive the parse.
void addLensOptions(VerbOptions& verb, LensOptions& options);

/// Warns that rays through lenses do not hit the scene's lines and points, or, if the scene is to
/// be read strictly, throws Error (kInput). `pictures`: what lacks them. Does nothing if there are
/// none.
void warnOfThin(const PosedScene& posed, const SceneOptions& scene, const std::string& pictures,
                Reporter& reporter);

/// Notes how many pixels of `all` have no ray through the lens; nothing if all have one.
void noteWithoutRay(std::uint64_t pixels, std::uint64_t all, Reporter& reporter);

/// Sets the camera's lens and, from --fov, its intrinsics. Does nothing for a pinhole. Throws Error
/// (kUsage) if the coefficients do not fit the lens, or if the camera's other options do not.
void takeLens(const LensOptions& options, CameraOptions& camera);

}  // namespace peeler::cmd
