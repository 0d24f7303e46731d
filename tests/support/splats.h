// SPDX-License-Identifier: Apache-2.0
// Scenes of Gaussian splats.
#pragma once

#include "support/capture.h"

namespace peeler::test {

/// Adds a node with a primitive of points, for splats. Returns the primitive, which is valid until
/// the next mesh is added.
inline Primitive& addPoints(SceneBuilder& builder) {
    const int material = builder.material({1, 1, 1, 1});
    builder.triangles({{0, 0, 0}, {0, 0, 0}, {0, 0, 0}}, material);
    Primitive& primitive = builder.scene().meshes.back().primitives.front();
    primitive.topology = Topology::kPoints;
    primitive.positions.clear();
    return primitive;
}

}  // namespace peeler::test
