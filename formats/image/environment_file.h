// SPDX-License-Identifier: Apache-2.0
// Environments from equirectangular pictures (Radiance .hdr and OpenEXR) or built in.
#pragma once

#include <cstdint>
#include <string>

#include <peeler/scene.h>
#include "formats/file/read_warnings.h"

namespace peeler {

struct EnvironmentLimits {
    int max_side = 32768;                              ///< pixels
    std::uint64_t max_bytes = std::uint64_t{2} << 30;  ///< decoded, 16 bytes per pixel
};

/// Reads linear Rec. 709 radiance of the whole display window (OpenEXR: of the first part),
/// row-major, top to bottom. Pixels outside the data window are black, negative values become 0,
/// and alpha is ignored. The format is recognised by the first bytes. Unsupported settings of the
/// file become warnings. Throws Error (kInput) if the file has another format, is a cube map,
/// exceeds the limits or has non-finite values, naming the pixel, and Error (kMemory) if memory
/// runs out.
Environment readEnvironment(const std::string& path, ReadWarnings& warnings,
                            const EnvironmentLimits& limits = {});

/// Name of the built-in environment, embeddedStudio(); a file of that name is "./studio".
inline constexpr const char* kStudioName = "studio";

/// Returns the built-in environment, with a hash of its content.
Environment namedStudio();

/// Returns the built-in environment for its name, else readEnvironment().
Environment environmentNamed(const std::string& name_or_path, ReadWarnings& warnings);

}  // namespace peeler
