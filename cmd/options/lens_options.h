// SPDX-License-Identifier: Apache-2.0
// The options for lenses, of verbs that cast rays through them.
#pragma once

#include <optional>
#include <string>
#include <vector>

#include "cmd/options/camera_options.h"

namespace peeler::cmd {

class VerbOptions;

struct LensOptions {
    std::optional<std::string> model;
    std::optional<std::vector<double>> coefficients;

    bool isGiven() const { return model || coefficients; }
};

/// Declares --lens and --distortion. `options` must outlive the parse.
void addLensOptions(VerbOptions& verb, LensOptions& options);

/// Sets the camera's lens and, from --fov, its intrinsics. Does nothing for a pinhole. Throws Error
/// (kUsage) if the coefficients do not fit the lens, or if the camera's other options do not.
void takeLens(const LensOptions& options, CameraOptions& camera);

}  // namespace peeler::cmd
