// SPDX-License-Identifier: Apache-2.0
// glTF reading options.
#pragma once

#include <cstdint>
#include <string>
#include <vector>

#include <peeler/memory_budget.h>

#pragma GCC visibility push(default)

namespace peeler::inline v0 {

/// Options for reading glTF: strictness, optional parts, size limits.
struct GltfOptions {
    /// Turns the first warning into an Error. An uncompressed fallback does not excuse damaged
    /// compressed data, or a damaged WebP or KTX2 image.
    bool strict = false;
    /// Lets URIs leave the scene's folder: absolute paths, "..", symbolic links.
    bool allow_outside = false;
    /// False: ignore KHR_materials_transmission and KHR_materials_volume, so that every surface
    /// follows its alpha mode.
    bool transmission = true;
    /// Unsupported extensions that the file may require. A texture is left out, with a warning, if
    /// its only image needs such an extension.
    std::vector<std::string> ignored_extensions{};
    std::uint64_t max_file_bytes = std::uint64_t{2} << 30;  ///< of the scene and each file it names
    std::uint64_t max_image_bytes = std::uint64_t{1} << 30;  ///< per image, decoded to RGBA
    /// For all vertices and indices in memory together: many primitives may share the same bytes of
    /// a small file.
    std::uint64_t max_geometry_bytes = std::uint64_t{16} << 30;
    int max_image_dimension = 16384;  ///< width and height, pixels
    /// Data over the budget is refused (kMemory) before it is allocated.
    MemoryBudget memory{};

    bool operator==(const GltfOptions&) const = default;
};

}  // namespace peeler::inline v0

#pragma GCC visibility pop
