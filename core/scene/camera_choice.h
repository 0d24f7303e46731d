// SPDX-License-Identifier: Apache-2.0
// The limits of pictures, and the checks of sizes, crops and names of cameras.
#pragma once

#include <cstdint>
#include <string>

#include <peeler/camera_choice.h>
#include <peeler/window.h>

namespace peeler {

inline constexpr int kMostPictureSide = 65536;
inline constexpr std::uint64_t kMostPixels = std::uint64_t{1} << 30;

/// Whether a camera's name is that of a light.
bool namesLight(const std::string& camera);

/// `size`, its height taken from the aspect ratio (width / height) if it has none. Throws Error
/// (kUsage) if the picture would be too high or too large.
Size sizeWithAspect(Size size, double aspect);

/// Throws Error (kUsage) for a picture that is too large.
void checkPixels(const Size& size);

/// Throws Error (kUsage) for a crop that reaches outside the picture.
void checkCrop(const Window& crop, int width, int height);

}  // namespace peeler
