// SPDX-License-Identifier: Apache-2.0
// The options of reading a glTF file.
#pragma once

#include <cstdint>
#include <string>
#include <vector>

#include <peeler/memory_budget.h>

#pragma GCC visibility push(default)

namespace peeler::inline v0 {

/// The parts of a file that are read, how strictly, and the limits of its size.
struct GltfOptions {
    /// The first warning is an Error instead: whatever the file says is shown, or nothing is. An
    /// uncompressed fallback does not excuse damaged compressed data, nor a WebP or KTX2 image.
    bool strict = false;
    /// URIs may lead out of the scene's folder: absolute paths, "..", symbolic links.
    bool allow_outside = false;
    /// False: KHR_materials_transmission and KHR_materials_volume are left unread, so that every
    /// surface is what its alpha mode says.
    bool transmission = true;
    /// Extensions that the file may require although they are not supported. A texture whose only
    /// image is of such an extension is left out, with a warning.
    std::vector<std::string> ignored_extensions{};
    std::uint64_t max_file_bytes = std::uint64_t{2} << 30;  ///< of the scene and each file it names
    std::uint64_t max_image_bytes = std::uint64_t{1} << 30;  ///< of each image, decoded to RGBA
    /// Of all vertices and indices together, as the scene holds them: many primitives may share the
    /// same bytes of a small file.
    std::uint64_t max_geometry_bytes = std::uint64_t{16} << 30;
    int max_image_dimension = 16384;  ///< width and height, pixels
    /// Reading keeps within it: what would not fit is refused (kMemory) before it is allocated.
    MemoryBudget memory{};

    bool operator==(const GltfOptions&) const = default;
};

}  // namespace peeler::inline v0

#pragma GCC visibility pop
