// SPDX-License-Identifier: Apache-2.0
// Environments from equirectangular pictures: Radiance (.hdr) and OpenEXR; or by name.
#pragma once

#include <cstdint>
#include <string>

#include "core/scene/scene.h"

namespace peeler {

struct EnvironmentLimits {
    int max_side = 32768;                              ///< pixels
    std::uint64_t max_bytes = std::uint64_t{2} << 30;  ///< decoded, 16 bytes a pixel
};

/// Linear Rec. 709 radiance of the whole display window (of OpenEXR: of the first part), row-major,
/// top to bottom; pixels outside the data window are black, negative numbers become 0, and alpha is
/// left aside. The format is told by the first bytes. Throws Error (kInput) for any other format,
/// for what is larger than the limits, and for numbers that are not finite, naming the pixel;
/// (kMemory).
Environment readEnvironment(const std::string& path, const EnvironmentLimits& limits = {});

/// The name of the built-in environment, embeddedStudio(); a file of that name is "./studio".
inline constexpr const char* kStudioName = "studio";

/// The built-in environment for its name, else what readEnvironment reads; with a hash of the
/// content either way.
Environment environmentNamed(const std::string& name_or_path);

}  // namespace peeler
