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
    /// Turns the first warning into an Error. Also rejects damaged compressed data, and damaged
    /// WebP and KTX2 images, even if the file has an uncompressed fallback.
    bool strict = false;
    /// Allows URIs to leave the scene's folder: absolute paths, "..", symbolic links.
    bool allow_outside = false;
    /// Whether to read KHR_materials_transmission and KHR_materials_volume. If false, the opacity
    /// of every surface depends only on its alpha mode.
    bool transmission = true;
    /// Names of unsupported extensions that are ignored even if the file requires them. A texture
    /// whose only image needs one of these extensions is left out, with a warning.
    std::vector<std::string> ignored_extensions{};
    /// Limit for each file: scene, buffer or image.
    std::uint64_t max_file_bytes = std::uint64_t{2} << 30;
    /// Limit for each image, decoded to RGBA.
    std::uint64_t max_image_bytes = std::uint64_t{1} << 30;
    /// Maximum number of bytes of all vertices and indices in memory. Primitives may share bytes of
    /// the file, so a small file may need much memory.
    std::uint64_t max_geometry_bytes = std::uint64_t{16} << 30;
    int max_image_dimension = 16384;  ///< pixels
    /// Data that would exceed the budget is refused (kMemory) before it is allocated.
    MemoryBudget memory{};

    bool operator==(const GltfOptions&) const = default;
};

}  // namespace peeler::inline v0

#pragma GCC visibility pop
