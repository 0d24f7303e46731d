// SPDX-License-Identifier: Apache-2.0
// Walks a scene's node forest: what it shows, and how large that is.
#include "core/scene.h"

#include "core/error.h"

namespace peeler {

void chooseVariant(Scene& scene, std::size_t variant) {
    for (Mesh& mesh : scene.meshes)
        for (Primitive& primitive : mesh.primitives)
            if (variant < primitive.variants.size() && primitive.variants[variant] >= 0)
                primitive.material = primitive.variants[variant];
}

SceneContents contents(const Scene& scene, int scene_index) {
    if (scene_index < 0 || static_cast<std::size_t>(scene_index) >= scene.scenes.size())
        throw Error(ErrorKind::kUsage, "there is no scene " + std::to_string(scene_index), "",
                    "the file has " + std::to_string(scene.scenes.size()));

    // A stack of our own: files nest as deep as they like. Last in, first out, so children are
    // pushed in reverse to come out in the file's order.
    struct Pending {
        int node;
        glm::dmat4 parent_world;
    };
    std::vector<Pending> stack;
    const auto push = [&](const std::vector<int>& nodes, const glm::dmat4& parent_world) {
        for (auto node = nodes.rbegin(); node != nodes.rend(); ++node)
            stack.push_back({*node, parent_world});
    };
    SceneContents result;
    push(scene.scenes[static_cast<std::size_t>(scene_index)].roots, glm::dmat4(1));
    while (!stack.empty()) {
        const Pending next = stack.back();
        stack.pop_back();
        const Node& node = scene.nodes[static_cast<std::size_t>(next.node)];
        const glm::dmat4 world = next.parent_world * node.local;
        if (node.mesh >= 0) result.meshes.push_back({next.node, node.mesh, world});
        if (node.camera >= 0) result.cameras.push_back({next.node, node.camera, world});
        if (node.light >= 0) result.lights.push_back({next.node, node.light, world});
        push(node.children, world);
    }
    return result;
}

std::optional<Bounds> bounds(const Scene& scene, const SceneContents& contents) {
    std::optional<Bounds> result;
    for (const MeshInstance& instance : contents.meshes) {
        for (const Primitive& primitive :
             scene.meshes[static_cast<std::size_t>(instance.mesh)].primitives) {
            for (const glm::vec3& position : primitive.positions) {
                const glm::dvec3 point(instance.world * glm::dvec4(position, 1));
                if (!result) result = Bounds{point, point};
                result->min = glm::min(result->min, point);
                result->max = glm::max(result->max, point);
            }
        }
    }
    return result;
}

double reach(const Scene& scene, const SceneContents& contents, const glm::dvec3& origin,
             const glm::dvec3& direction) {
    double farthest = -std::numeric_limits<double>::infinity();
    for (const MeshInstance& instance : contents.meshes) {
        // The direction is taken to the mesh instead of every vertex to the world.
        const glm::dvec3 local = glm::transpose(glm::dmat3(instance.world)) * direction;
        const double offset = glm::dot(glm::dvec3(instance.world[3]) - origin, direction);
        for (const Primitive& primitive :
             scene.meshes[static_cast<std::size_t>(instance.mesh)].primitives) {
            for (const glm::vec3& position : primitive.positions)
                farthest = std::max(farthest, glm::dot(local, glm::dvec3(position)) + offset);
        }
    }
    return farthest;
}

}  // namespace peeler
