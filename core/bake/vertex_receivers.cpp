// SPDX-License-Identifier: Apache-2.0
// Vertices to world space, with the normals that they have or ought to have.
#include "core/bake/vertex_receivers.h"

#include <string>

#include "core/base/error.h"
#include "core/base/parallel.h"
#include "core/base/unit_vector.h"
#include "core/scene/primitive_corners.h"

namespace peeler {

VertexReceivers::VertexReceivers(const PosedScene& posed) : posed_(posed) {
    std::size_t count = 0;
    for (std::size_t i = 0; i < posed.meshes().size(); ++i) {
        first_range_.push_back(ranges_.size());
        const std::vector<Primitive>& primitives = posed.primitives(posed.meshes()[i]);
        for (std::size_t p = 0; p < primitives.size(); ++p) {
            const Primitive& primitive = primitives[p];
            const std::size_t vertices = isOfTriangles(primitive) ? primitive.positions.size() : 0;
            ranges_.push_back({i, p, count, vertices});
            count += vertices;
        }
    }
    if (count > kMostReceivers)
        throw Error(ErrorKind::kInput,
                    "the scene shows " + std::to_string(count) + " vertices, at most " +
                        std::to_string(kMostReceivers) + " can be baked for",
                    "", "bake parts of it: --include, --exclude");
    receivers_.positions.resize(count);
    receivers_.normals.resize(count);
    parallelFor(ranges_.size(), [&](std::size_t range) { fill(ranges_[range]); });
}

void VertexReceivers::fill(const VertexRange& range) {
    const MeshInstance& instance = posed_.meshes()[range.instance];
    const Primitive& primitive = posed_.primitives(instance)[range.primitive];
    const auto& local = posed_.positions(instance, range.primitive);
    if (range.count == 0) return;
    const auto& normals = posed_.normals(instance, range.primitive);
    std::vector<glm::dvec3> world(local.size()), sums(local.size(), glm::dvec3(0));
    std::vector<char> used(local.size(), 0);
    for (std::size_t i = 0; i < local.size(); ++i) {
        world[i] = glm::dvec3(instance.world * glm::dvec4(local[i], 1));
        receivers_.positions[range.first + i] = world[i];
    }
    // In world space, since a skin can mirror without the instance's matrix saying so.
    const double side = instance.mirrored ? -1 : 1;
    for (std::uint32_t t = 0; t < elementsOf(primitive); ++t) {
        const auto [a, b, c] = cornersOf(primitive, t).vertex;
        const glm::dvec3 area = side * glm::cross(world[b] - world[a], world[c] - world[a]);
        for (const std::size_t corner : {a, b, c}) {
            sums[corner] += area;
            used[corner] = 1;
        }
    }
    const glm::dmat3 turn = normalMatrix(glm::dmat3(instance.world));
    for (std::size_t i = 0; i < local.size(); ++i) {
        if (!used[i]) continue;
        glm::vec3& normal = receivers_.normals[range.first + i];
        if (!normals.empty()) normal = unitOrZero(turn * glm::dvec3(normals[i]));
        if (normal == glm::vec3(0)) normal = unitOrZero(sums[i]);
    }
}

SurfaceLookup VertexReceivers::lookup() const {
    return [this](std::span<const float> values, std::uint32_t key, const glm::vec2& barycentric) {
        const KeyOrigin origin = posed_.drawList().originOf(key);
        const VertexRange& from = range(origin.instance, origin.primitive);
        if (from.count == 0) return glm::vec3(0);
        const Corners corners = cornersOf(posed_.primitive(origin), origin.element);
        const float weights[] = {1 - barycentric.x - barycentric.y, barycentric.x, barycentric.y};
        glm::vec3 sum(0);
        for (std::size_t i = 0; i < 3; ++i) {
            const float* value = values.data() + 3 * (from.first + corners.vertex[i]);
            sum += weights[i] * glm::vec3(value[0], value[1], value[2]);
        }
        return sum;
    };
}

}  // namespace peeler
