// SPDX-License-Identifier: Apache-2.0
// Vertices that morph targets and skins move.
#pragma once

#include <glm/glm.hpp>
#include <span>
#include <vector>

#include "core/scene/scene.h"

namespace peeler {

/// What takes the place of a primitive's own arrays; as many elements, and empty where those are.
struct DeformedVertices {
    std::vector<glm::vec3> positions, normals;
    std::vector<glm::vec4> tangents;
};

/// The joints of a skin at a moment, each the product of where it is and its inverse bind matrix.
struct JointMatrices {
    std::vector<glm::dmat4> joints;
    glm::dmat4 unskinned{1};  ///< for primitives without joints, which follow their node
};

/// What turns normals where `m` takes positions: its inverse transpose, up to a positive factor; of
/// a singular matrix, too.
glm::dmat3 normalMatrix(const glm::dmat3& m);

/// What moves a vertex: the weighted mean of its joints.
glm::dmat4 skinMatrix(const Primitive& primitive, const JointMatrices& skin, std::size_t vertex);

/// The vertices of a primitive after its morph targets (glTF 2.0 §3.7.2.2; missing weights are 0)
/// and, if `skin` is given, its joints (§3.7.3.3: linear blend skinning with all joint sets,
/// weights scaled to add up to 1, where they are all 0 the first joint). Normals turn with the
/// inverse transpose. Vertices are done in parallel; the result does not depend on how.
DeformedVertices deform(const Primitive& primitive, std::span<const double> weights,
                        const JointMatrices* skin);

}  // namespace peeler
