// SPDX-License-Identifier: Apache-2.0
// Where the nodes of a scene are at a moment, and what it shows then: meshes, cameras and lights in
// their places, and what is drawn.
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

// animation.cpp.

/// Evaluates keyframes (glTF 2.0 §3.11, appendix C) at a time that is rounded to a float, as theirs
/// are: exactly the key's value at its time, the first or the last one before and after them.
/// `value` has the width of one value. Of quaternions (x, y, z, w: `rotation`) kLinear is a
/// spherical interpolation along the shorter arc.
void sampleKeyframes(const Keyframes& keyframes, double time, bool rotation,
                     std::span<double> value);

/// When the last key of the animation is, in seconds; 0 if it has none.
double durationOf(const Animation& animation);

/// Where every node of a scene is at a moment, and how its meshes are morphed.
struct Pose {
    std::vector<glm::dmat4> locals;              ///< of every node, relative to its parent
    std::map<int, std::vector<double>> weights;  ///< of nodes whose morph weights are animated
};

/// Every node as the file places it.
Pose restPose(const Scene& scene);

/// At a time in seconds, as these animations (indices into Scene::animations) have it; where two
/// change the same property, the later one counts. What they leave alone is at rest.
Pose poseAt(const Scene& scene, std::span<const int> animations, double time);

// posed_scene.cpp.

/// A node that stands elsewhere than its file says.
struct PlacedNode {
    int node = 0;
    glm::dmat4 to_world{1};  ///< rotation and translation
};

/// Moves nodes, below whatever they are, such that they stand where they are told to; each keeps
/// the scale that it has in the pose. `index` is the scene that is shown. Throws Error (kInput) for
/// a node whose own matrix, or whose parent's, has no inverse.
void placeNodes(const Scene& scene, int index, std::span<const PlacedNode> nodes, Pose& pose);

/// The vertices of a primitive after its morph targets and joints, in place of its own arrays: as
/// many elements, and empty where those are. Texture coordinates and colours that no target
/// displaces are empty, too: the primitive's own count. The same ones at all times.
struct DeformedVertices {
    std::vector<glm::vec3> positions, normals;
    std::vector<glm::vec4> tangents;
    std::array<std::vector<glm::vec2>, 2> texcoords{};
    std::vector<glm::vec4> colors{};
};

/// `v` scaled to unit length; 0 if it has no length.
template <class T>
glm::vec<3, T> unitOrZero(const glm::vec<3, T>& v) {
    const T length = glm::length(v);
    return length > 0 ? v / length : glm::vec<3, T>(0);
}

/// What turns normals where `m` takes positions: its inverse transpose, up to a positive factor; of
/// a singular matrix, too.
glm::dmat3 normalMatrix(const glm::dmat3& m);

/// A mesh in its place. `world` is the product of the node matrices from the root (and of the
/// instance's, EXT_mesh_gpu_instancing). A skinned mesh is in world space but for a translation.
struct MeshInstance {
    int node = 0;
    int mesh = 0;
    glm::dmat4 world{1};
    bool mirrored = false;  ///< front faces are clockwise
    int deformed = -1;      ///< index into PosedScene::deformed(), −1 = the mesh as it is
    bool operator==(const MeshInstance&) const = default;
};

/// A camera in its place: it looks along −Z of `world`, which may scale.
struct CameraInstance {
    int node = 0;
    int camera = 0;
    glm::dmat4 world{1};
};

/// A light in its place: it shines along −Z of `world`, which may scale.
struct LightInstance {
    int node = 0;
    int light = 0;
    glm::dmat4 world{1};
    bool operator==(const LightInstance&) const = default;
};

using DeformedMesh = std::vector<DeformedVertices>;  ///< of each primitive

/// What one of the scenes of a file shows in a pose, depth first: the draw order. At all times of a
/// scene the same instances are there, in the same order. Copies are cheap: they share what they
/// hold, which never changes.
class PosedScene {
  public:
    /// `index` counts Scene::scenes; `scene` must outlive this and all copies. Throws Error
    /// (kUsage) if there is no such scene.
    PosedScene(const Scene& scene, int index, const Pose& pose);
    /// The scene at rest.
    PosedScene(const Scene& scene, int index);
    /// The file's default scene at rest.
    explicit PosedScene(const Scene& scene) : PosedScene(scene, scene.default_scene) {}

    const Scene& scene() const { return shown_->scene; }
    const std::vector<MeshInstance>& meshes() const { return shown_->meshes; }
    const std::vector<CameraInstance>& cameras() const { return shown_->cameras; }
    const std::vector<LightInstance>& lights() const { return shown_->lights; }
    /// The vertices of meshes with morph targets or a skin.
    const std::vector<DeformedMesh>& deformed() const { return shown_->deformed; }

    /// What is drawn, and the keys of its primitives; made when it is first asked for. May be
    /// called from several threads. Throws Error (kInput) if the scene has 2^32 primitives or more.
    const DrawList& drawList() const;

    const std::vector<Primitive>& primitives(const MeshInstance& instance) const {
        return scene().meshes[static_cast<std::size_t>(instance.mesh)].primitives;
    }
    const Primitive& primitive(const KeyOrigin& origin) const {
        return primitives(meshes()[origin.instance])[origin.primitive];
    }
    /// The arrays of a primitive of an instance as they are shown, positions, normals and tangents
    /// in the space that its `world` starts from; empty where its file has none.
    const std::vector<glm::vec3>& positions(const MeshInstance& instance,
                                            std::size_t primitive) const;
    const std::vector<glm::vec3>& normals(const MeshInstance& instance,
                                          std::size_t primitive) const;
    const std::vector<glm::vec3>& positions(const Geometry& geometry) const;
    const std::vector<glm::vec3>& normals(const Geometry& geometry) const;
    const std::vector<glm::vec4>& tangents(const Geometry& geometry) const;
    const std::vector<glm::vec2>& texcoords(const Geometry& geometry, int set) const;
    const std::vector<glm::vec4>& colors(const Geometry& geometry) const;

    /// Of every instance, which it is among those of its node.
    std::vector<std::uint32_t> instanceOrdinals() const;

    /// Whether anything that is drawn lets coloured light through: isTintedGlass(), or what
    /// transmits light and has colours at its vertices. The same at all times.
    bool hasTintedGlass() const;

    /// The box around all vertices; nothing if there is none.
    std::optional<Bounds> bounds() const;

    /// How far the vertices reach along a world direction: the largest dot(direction, p − origin).
    /// −inf if there is no vertex. Tighter than the bounds when looking at them askew.
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

    /// array_of() of the deformed vertices, or of the primitive where these have none.
    template <class ArrayOf>
    const auto& arrayOf(const Geometry& geometry, const ArrayOf& array_of) const;

    std::shared_ptr<Shown> shown_;
};

}  // namespace peeler
