// SPDX-License-Identifier: Apache-2.0
// The options of reading a scene in any format.
#pragma once

#include <cstdint>
#include <optional>

#include <peeler/gltf_options.h>

#pragma GCC visibility push(default)

namespace peeler::inline v0 {

enum class Axis : std::uint8_t { kX, kY, kZ };

/// GltfOptions hold for every format, where it has such things. The rest is for PLY, STL and OBJ,
/// which do not say it; a glTF, which does, is read as it is, with a warning.
struct SceneReadOptions : GltfOptions {
    std::optional<Axis> up;                 ///< which axis of the file is +Y of the scene; none: y
    std::optional<double> metres_per_unit;  ///< the scene has metres then; none: 1, as they stand
    /// Where the file has no normals: surfaces are smooth across edges whose triangles are turned
    /// against each other by so many degrees at most, from 0 to 180; none: all triangles are flat.
    std::optional<double> smooth_normals;

    bool operator==(const SceneReadOptions&) const = default;
};

}  // namespace peeler::inline v0

#pragma GCC visibility pop
