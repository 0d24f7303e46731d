// SPDX-License-Identifier: Apache-2.0
// Lenses as JSON, with all numbers in double precision.
#pragma once

#include <nlohmann/json_fwd.hpp>
#include <string>

#include "core/lens/picture_rays.h"

namespace peeler {

/// Returns `model`, `coefficients` and `intrinsics`: [fx, fy, cx, cy] in pixels, (0, 0) being the
/// centre of the upper left pixel, or null if the lens fills the picture.
nlohmann::json lensJson(const LensCamera& camera);

/// The inverse of lensJson(). Throws Error (kInput), naming `where`, if the coefficients or the
/// intrinsics have no meaning, and nlohmann::json::exception if the JSON has another form.
LensCamera lensOfJson(const nlohmann::json& json, const std::string& where);

}  // namespace peeler
