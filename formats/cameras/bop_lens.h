// SPDX-License-Identifier: Apache-2.0
// Lenses of BOP's cameras since 2024, as in HOT3D: the member cam_model, which replaces cam_K.
// https://github.com/thodan/bop_toolkit/blob/master/bop_toolkit_lib/pose_error_htt.py
#pragma once

#include <nlohmann/json.hpp>
#include <optional>
#include <string_view>

#include <peeler/camera_choice.h>
#include "core/lens/lens.h"

namespace peeler {

/// The only type of lens in BOP's datasets: Aria's FISHEYE624, which includes OpenCV's fisheye.
inline constexpr std::string_view kBopLensType = "CameraModelType.FISHEYE624";

/// Returns cam_model; nothing if FISHEYE624 does not include the lens.
std::optional<nlohmann::json> bopCameraModel(const Lens& lens, const Intrinsics& intrinsics,
                                             const Size& size);

}  // namespace peeler
