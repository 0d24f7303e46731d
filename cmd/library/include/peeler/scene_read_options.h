// SPDX-License-Identifier: Apache-2.0
// Scene reading options for all formats.
#pragma once

#include <cstdint>
#include <optional>

#include <peeler/gltf_options.h>

#pragma GCC visibility push(default)

namespace peeler::inline v0 {

enum class Axis : std::uint8_t { kX, kY, kZ };

/// Options for reading scenes. The GltfOptions apply to every format that has the feature. The
/// fields below are for PLY, STL and OBJ, which do not specify axes, units and smoothing. glTF
/// specifies all three and 3MF the first two, so their readers ignore these fields with a warning.
struct SceneReadOptions : GltfOptions {
    std::optional<Axis> up;                 ///< the file's axis that becomes +Y; none = Y
    std::optional<double> metres_per_unit;  ///< scale from the file's unit to metres; none = 1
    /// For files without normals: the largest angle in degrees, 0 to 180, between triangles that
    /// are shaded smoothly across their common edge. Without a value, triangles are shaded flat.
    std::optional<double> smooth_normals;

    bool operator==(const SceneReadOptions&) const = default;
};

}  // namespace peeler::inline v0

#pragma GCC visibility pop
