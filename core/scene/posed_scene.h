// SPDX-License-Identifier: Apache-2.0
// A posed scene: node transforms, and instances of meshes, cameras and lights, at a moment.
#pragma once

#include <array>
#include <cstdint>
#include <glm/glm.hpp>
#include <map>
#include <memory>
#include <mutex>
#include <optional>
#include <span>
#include <vector>

#include <peeler/scene.h>
#include "core/scene/draw_list.h"

namespace peeler {

// Defined in animation.cpp.

/// Evaluates keyframes (glTF 2.0 §3.11, appendix C). The time is rounded to a float, as keys' times
/// are. The result at a key's time is exactly the key's value; before the first key or after the
/// last, it is the first or last key's value. `value` receives the result, and its size must be the
/// result's number of components. For quaternions (x, y, z, w: `rotation`), kLinear interpolates
/// spherically along the shorter arc.
void sampleKeyframes(const Keyframes& keyframes, double time, bool rotation,
                     std::span<double> value);

/// Returns the time of the animation's last key, in seconds; 0 if there are no keys.
double durationOf(const Animation& animation);

/// The transforms of all nodes at a moment, and the morph weights.
struct Pose {
    std::vector<glm::dmat4> locals;  ///< transform of each node relative to its parent
    /// Morph weights by node, only for nodes with animated weights.
    std::map<int, std::vector<double>> weights;
};

/// Returns the pose of the file without animations.
Pose restPose(const Scene& scene);

/// Returns the pose at a time in seconds under these animations (indices into Scene::animations).
/// If several animations change the same property, the last one in the list wins. Properties
/// without animation stay at rest.
Pose poseAt(const Scene& scene, std::span<const int> animations, double time);

// Defined in posed_scene.cpp.

/// A node, with a new position and rotation in world space.
struct PlacedNode {
    int node = 0;
    glm::dmat4 to_world{1};  ///< rotation and translation
};

/// Moves nodes to the given transforms, regardless of their parents. Each node keeps its scale in
/// the pose. `index` is the index of the displayed scene. Throws Error (kInput) if the matrix of a
/// node or of its parent has no inverse.
void placeNodes(const Scene& scene, int index, std::span<const PlacedNode> nodes, Pose& pose);

/// The vertices of a primitive after morphing and skinning. These arrays replace the primitive's
/// own arrays, and have the same lengths. Texture coordinates and colours without morph targets are
/// empty here; the primitive's own arrays then apply. Which arrays are empty does not depend on the
/// time.
struct DeformedVertices {
    std::vector<glm::vec3> positions, normals;
    std::vector<glm::vec4> tangents;
    std::array<std::vector<glm::vec2>, 2> texcoords{};
    std::vector<glm::vec4> colors{};
};

/// Returns `v` normalised; 0 if its length is 0.
template <class T>
glm::vec<3, T> unitOrZero(const glm::vec<3, T>& v) {
    const T length = glm::length(v);
    return length > 0 ? v / length : glm::vec<3, T>(0);
}

/// Returns the normal matrix for `m`: its inverse transpose, up to a positive factor. Also valid
/// for a singular matrix.
glm::dmat3 normalMatrix(const glm::dmat3& m);

/// A placed mesh. `world` is the product of the node matrices from the root, times the instance's
/// matrix (EXT_mesh_gpu_instancing). The vertices of a skinned mesh are in world space except for a
/// translation.
struct MeshInstance {
    int node = 0;
    int mesh = 0;
    glm::dmat4 world{1};
    bool mirrored = false;  ///< whether front faces are clockwise
    int deformed = -1;      ///< index into PosedScene::deformed(); −1 if not deformed
    bool operator==(const MeshInstance&) const = default;
};

/// A placed camera, which looks along −Z of `world`. `world` may contain a scale.
struct CameraInstance {
    int node = 0;
    int camera = 0;
    glm::dmat4 world{1};
};

/// A placed light, which shines along −Z of `world`. `world` may contain a scale.
struct LightInstance {
    int node = 0;
    int light = 0;
    glm::dmat4 world{1};
    bool operator==(const LightInstance&) const = default;
};

using DeformedMesh = std::vector<DeformedVertices>;  ///< one entry per primitive

/// The contents of one of a file's scenes in a pose, in draw order (depth first). The instances and
/// their order do not depend on the time. Copies are cheap, because they share immutable contents.
class PosedScene {
  public:
    /// `index` is an index into Scene::scenes. `scene` must outlive this object and all its copies.
    /// Throws Error (kUsage) if there is no such scene.
    PosedScene(const Scene& scene, int index, const Pose& pose);
    /// Poses the scene at rest.
    PosedScene(const Scene& scene, int index);
    /// Poses the file's default scene at rest.
    explicit PosedScene(const Scene& scene) : PosedScene(scene, scene.default_scene) {}

    const Scene& scene() const { return shown_->scene; }
    const std::vector<MeshInstance>& meshes() const { return shown_->meshes; }
    const std::vector<CameraInstance>& cameras() const { return shown_->cameras; }
    const std::vector<LightInstance>& lights() const { return shown_->lights; }
    /// Returns the vertices of meshes with morph targets or a skin.
    const std::vector<DeformedMesh>& deformed() const { return shown_->deformed; }

    /// Returns the draw list, built on first use. Thread-safe. Throws Error (kInput) if the scene
    /// has 2^32 primitives or more.
    const DrawList& drawList() const;

    const std::vector<Primitive>& primitives(const MeshInstance& instance) const {
        return scene().meshes[static_cast<std::size_t>(instance.mesh)].primitives;
    }
    const Primitive& primitive(const KeyOrigin& origin) const {
        return primitives(meshes()[origin.instance])[origin.primitive];
    }
    /// Return a primitive's arrays as displayed. Arrays that the file lacks are empty. Positions,
    /// normals and tangents are in the space that the instance's `world` transforms to world space.
    const std::vector<glm::vec3>& positions(const MeshInstance& instance,
                                            std::size_t primitive) const;
    const std::vector<glm::vec3>& normals(const MeshInstance& instance,
                                          std::size_t primitive) const;
    const std::vector<glm::vec3>& positions(const Geometry& geometry) const;
    const std::vector<glm::vec3>& normals(const Geometry& geometry) const;
    const std::vector<glm::vec4>& tangents(const Geometry& geometry) const;
    const std::vector<glm::vec2>& texcoords(const Geometry& geometry, int set) const;
    const std::vector<glm::vec4>& colors(const Geometry& geometry) const;

    /// Returns, for every mesh instance, its index among the instances of its node.
    std::vector<std::uint32_t> instanceOrdinals() const;

    /// Whether anything drawn transmits coloured light, through tinted glass (isTintedGlass()) or a
    /// transmissive surface with vertex colours. The answer does not depend on the time.
    bool hasTintedGlass() const;

    /// Returns the bounding box of all vertices; nullopt if there are no vertices.
    std::optional<Bounds> bounds() const;

    /// Returns the maximum of dot(direction, p − origin) over the vertices p, in world space; −inf
    /// if there are no vertices. Tighter than the bounds for oblique directions.
    double reach(const glm::dvec3& origin, const glm::dvec3& direction) const;

  private:
    struct Shown {
        explicit Shown(const Scene& whole) : scene(whole) {}

        const Scene& scene;
        std::vector<MeshInstance> meshes;
        std::vector<CameraInstance> cameras;
        std::vector<LightInstance> lights;
        std::vector<DeformedMesh> deformed;
        std::once_flag listed;
        std::optional<DrawList> draw_list;
    };
    class Builder;

    /// Returns array_of() of the deformed vertices; if this array is empty, array_of() of the
    /// primitive.
    template <class ArrayOf>
    const auto& arrayOf(const Geometry& geometry, const ArrayOf& array_of) const;

    std::shared_ptr<Shown> shown_;
};

}  // namespace peeler
