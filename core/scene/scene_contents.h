// SPDX-License-Identifier: Apache-2.0
// What a scene shows at a moment: meshes, cameras and lights in their places.
#pragma once

#include <cstdint>
#include <optional>
#include <vector>

#include "core/scene/deformation.h"
#include "core/scene/pose.h"
#include "core/scene/scene.h"

namespace peeler {

/// A mesh in its place. `world` is the product of the node matrices from the root (and of the
/// instance's, EXT_mesh_gpu_instancing). A skinned mesh is in world space but for a translation.
struct MeshInstance {
    int node = 0;
    int mesh = 0;
    glm::dmat4 world{1};
    bool mirrored = false;  ///< front faces are clockwise
    int deformed = -1;      ///< index into SceneContents::deformed, −1 = the mesh as it is
    bool operator==(const MeshInstance&) const = default;
};

struct CameraInstance {
    int node = 0;
    int camera = 0;
    glm::dmat4 world{1};
};

struct LightInstance {
    int node = 0;
    int light = 0;
    glm::dmat4 world{1};
    bool operator==(const LightInstance&) const = default;
};

using DeformedMesh = std::vector<DeformedVertices>;  ///< of each primitive

/// What one of the scenes shows, depth first: the draw order. At all times of a scene the same
/// instances are there, in the same order.
struct SceneContents {
    std::vector<MeshInstance> meshes;
    std::vector<CameraInstance> cameras;
    std::vector<LightInstance> lights;
    std::vector<DeformedMesh> deformed;  ///< of meshes with morph targets or a skin
};
SceneContents contents(const Scene& scene, int scene_index, const Pose& pose);
/// At rest.
SceneContents contents(const Scene& scene, int scene_index);

/// Of every instance, which it is among those of its node.
std::vector<std::uint32_t> instanceOrdinals(const SceneContents& contents);

/// The positions of a primitive of an instance, in the space that its `world` starts from.
const std::vector<glm::vec3>& positionsOf(const Scene& scene, const SceneContents& contents,
                                          const MeshInstance& instance, std::size_t primitive);

/// Axis-aligned bounds in world space; nothing if there is no vertex.
struct Bounds {
    glm::dvec3 min{0}, max{0};
};
std::optional<Bounds> bounds(const Scene& scene, const SceneContents& contents);

/// How far the vertices reach along a world direction: the largest dot(direction, p − origin). −inf
/// if there is no vertex. Tighter than the bounds when looking at them askew.
double reach(const Scene& scene, const SceneContents& contents, const glm::dvec3& origin,
             const glm::dvec3& direction);

}  // namespace peeler
