// SPDX-License-Identifier: Apache-2.0
// Environments: readers of equirectangular pictures (Radiance .hdr and OpenEXR), and the built-in
// studio.
#pragma once

#include <cstdint>
#include <string>

#include <peeler/scene.h>
#include "formats/file/read_warnings.h"

namespace peeler {

struct EnvironmentLimits {
    int max_side = 32768;  ///< maximum width and height, in pixels
    /// Maximum decoded size in bytes, at 16 bytes per pixel.
    std::uint64_t max_bytes = std::uint64_t{2} << 30;
};

/// Reads an equirectangular picture (in OpenEXR, the first part) as linear Rec. 709 radiance,
/// row-major, top to bottom, over the whole display window. Pixels outside the data window are
/// black, negative values become 0, and alpha is ignored. The first bytes determine the format.
/// Warns about settings in the file that are not supported. Throws Error (kInput) if the file has
/// another format, is a cube map, exceeds the limits or has a value that is not finite (with the
/// pixel's coordinates). Throws Error (kMemory) if memory runs out.
Environment readEnvironment(const std::string& path, ReadWarnings& warnings,
                            const EnvironmentLimits& limits = {});

/// The name of the built-in environment, embeddedStudio(). "./studio" names a file called "studio".
inline constexpr const char* kStudioName = "studio";

/// Returns the built-in environment, with a hash of its content.
Environment namedStudio();

Environment environmentNamed(const std::string& name_or_path, ReadWarnings& warnings);

}  // namespace peeler
