// SPDX-License-Identifier: Apache-2.0
// Environments from equirectangular pictures: Radiance (.hdr) and OpenEXR; or by name.
#pragma once

#include <cstdint>
#include <string>

#include <peeler/scene.h>
#include "formats/file/read_warnings.h"

namespace peeler {

struct EnvironmentLimits {
    int max_side = 32768;                              ///< pixels
    std::uint64_t max_bytes = std::uint64_t{2} << 30;  ///< decoded, 16 bytes a pixel
};

/// Linear Rec. 709 radiance of the whole display window (of OpenEXR: of the first part), row-major,
/// top to bottom; pixels outside the data window are black, negative numbers become 0, and alpha is
/// left aside. The format is told by the first bytes. What the file says and is not carried out is
/// a warning. Throws Error (kInput) for any other format, for cube maps, for what is larger than
/// the limits, and for numbers that are not finite, naming the pixel; (kMemory).
Environment readEnvironment(const std::string& path, ReadWarnings& warnings,
                            const EnvironmentLimits& limits = {});

/// The name of the built-in environment, embeddedStudio(); a file of that name is "./studio".
inline constexpr const char* kStudioName = "studio";

/// The built-in environment, with a hash of its content.
Environment namedStudio();

/// The built-in environment for its name, else what readEnvironment reads.
Environment environmentNamed(const std::string& name_or_path, ReadWarnings& warnings);

}  // namespace peeler
