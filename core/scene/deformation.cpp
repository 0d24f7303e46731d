// SPDX-License-Identifier: Apache-2.0
#include "core/scene/deformation.h"

#include <algorithm>

#include "core/base/parallel.h"
#include "core/base/unit_vector.h"

namespace peeler {
namespace {

constexpr std::size_t kBlock = 4096;  // vertices a thread takes at a time

/// Calls body(first, end) for stretches of the vertices.
template <class Body>
void forBlocks(std::size_t vertices, const Body& body) {
    parallelFor((vertices + kBlock - 1) / kBlock, [&](std::size_t block) {
        body(block * kBlock, std::min(vertices, (block + 1) * kBlock));
    });
}

/// Adds w times a target's displacements to the first three components.
template <class Vector>
void displace(std::vector<Vector>& values, const std::vector<glm::vec3>& displacements, double w) {
    if (displacements.empty()) return;
    const auto weight = static_cast<float>(w);
    forBlocks(std::min(values.size(), displacements.size()), [&](std::size_t i, std::size_t end) {
        for (; i < end; ++i)
            for (int c = 0; c < 3; ++c)
                values[i][c] += weight * displacements[i][c];
    });
}

void applySkin(const Primitive& primitive, const JointMatrices& skin, DeformedVertices& vertices) {
    forBlocks(vertices.positions.size(), [&](std::size_t i, std::size_t end) {
        for (; i < end; ++i) {
            const glm::dmat4 matrix = skinMatrix(primitive, skin, i);
            const glm::dmat3 linear(matrix);
            auto& position = vertices.positions[i];
            position = glm::vec3(linear * glm::dvec3(position) + glm::dvec3(matrix[3]));
            if (!vertices.normals.empty()) {
                auto& normal = vertices.normals[i];
                normal = glm::vec3(unitOrZero(normalMatrix(linear) * glm::dvec3(normal)));
            }
            if (!vertices.tangents.empty()) {
                auto& tangent = vertices.tangents[i];
                const glm::dvec3 turned = unitOrZero(linear * glm::dvec3(tangent));
                tangent = glm::vec4(glm::vec3(turned), tangent.w);
            }
        }
    });
}

}  // namespace

glm::dmat3 normalMatrix(const glm::dmat3& m) {
    const glm::dmat3 cofactors(glm::cross(m[1], m[2]), glm::cross(m[2], m[0]),
                               glm::cross(m[0], m[1]));
    return glm::determinant(m) < 0 ? -cofactors : cofactors;
}

glm::dmat4 skinMatrix(const Primitive& primitive, const JointMatrices& skin, std::size_t vertex) {
    if (primitive.joint_sets.empty()) return skin.unskinned;
    glm::dmat4 sum(0);
    double total = 0;
    for (const JointSet& set : primitive.joint_sets) {
        for (int i = 0; i < 4; ++i) {
            const double weight = double{set.weights[vertex][i]};
            if (weight == 0) continue;
            sum += weight * skin.joints[set.joints[vertex][i]];
            total += weight;
        }
    }
    return total != 0 ? sum / total : skin.joints.front();
}

DeformedVertices deform(const Primitive& primitive, std::span<const double> weights,
                        const JointMatrices* skin) {
    DeformedVertices result{primitive.positions, primitive.normals, primitive.tangents};
    for (std::size_t i = 0; i < std::min(primitive.targets.size(), weights.size()); ++i) {
        if (weights[i] == 0) continue;
        const MorphTarget& target = primitive.targets[i];
        displace(result.positions, target.positions, weights[i]);
        displace(result.normals, target.normals, weights[i]);
        displace(result.tangents, target.tangents, weights[i]);
    }
    if (skin) applySkin(primitive, *skin, result);
    return result;
}

}  // namespace peeler
