// SPDX-License-Identifier: Apache-2.0
// Picture limits, and checks of sizes, crops and camera names.
#pragma once

#include <cstdint>
#include <string>

#include <peeler/camera_choice.h>
#include <peeler/window.h>

namespace peeler {

/// The maximum width and height of a picture that GL and common EXR readers support.
inline constexpr int kMostPictureSide = 65536;
/// The maximum number of pixels. It is low enough for pixel indices to fit into 32 bits.
inline constexpr std::uint64_t kMostPixels = std::uint64_t{1} << 30;

/// The vertical field of view, in degrees, of a camera that is built without one.
inline constexpr double kDefaultFov = 40;

/// Whether a camera name refers to a light.
bool namesLight(const std::string& camera);

/// Returns `size`. If the height is missing, computes it from the aspect ratio (width / height).
/// Throws Error (kUsage) if the picture would be too high or too large.
Size sizeWithAspect(Size size, double aspect);

/// Throws Error (kUsage) if the picture is too large.
void checkPixels(const Size& size);

/// Throws Error (kUsage) if the crop extends outside the picture.
void checkCrop(const Window& crop, int width, int height);

}  // namespace peeler
