// SPDX-License-Identifier: Apache-2.0
// Traversal of a scene's node forest: instances, deformed vertices, and bounds.
#include "core/scene/posed_scene.h"

#include <algorithm>
#include <glm/gtc/matrix_transform.hpp>
#include <limits>
#include <map>
#include <utility>

#include <peeler/error.h>
#include <peeler/view.h>
#include "core/base/parallel.h"
#include "core/scene/material.h"

namespace peeler {

/// The joint matrices of a skin at a moment: the product of each joint's transform and inverse bind
/// matrix. External linkage is needed because PosedScene::Builder has members of this type.
struct JointMatrices {
    std::vector<glm::dmat4> joints;
    glm::dmat4 unskinned{1};  ///< for primitives without joints, which follow their node
};

namespace {

constexpr std::size_t kBlock = 4096;  // vertices per task

/// Calls body(first, end) for blocks of vertices, in parallel.
template <class Body>
void forBlocks(std::size_t vertices, const Body& body) {
    parallelFor((vertices + kBlock - 1) / kBlock, [&](std::size_t block) {
        body(block * kBlock, std::min(vertices, (block + 1) * kBlock));
    });
}

/// Adds w times a target's displacements. If the values have more components than the
/// displacements, the additional components stay unchanged.
template <class Vector, class Displacement>
void displace(std::vector<Vector>& values, const std::vector<Displacement>& displacements,
              double w) {
    if (displacements.empty()) return;
    const auto weight = static_cast<float>(w);
    forBlocks(std::min(values.size(), displacements.size()), [&](std::size_t i, std::size_t end) {
        for (; i < end; ++i)
            for (int c = 0; c < Displacement::length(); ++c)
                values[i][c] += weight * displacements[i][c];
    });
}

/// Returns the skinning matrix of a vertex: the weighted mean of the matrices of its joints.
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

/// Returns the values if a target displaces them; otherwise an empty array.
template <class Vector, class ArrayOf>
std::vector<Vector> ifDisplaced(const std::vector<Vector>& values,
                                const std::vector<MorphTarget>& targets, const ArrayOf& array_of) {
    const bool displaced = std::ranges::any_of(
        targets, [&](const MorphTarget& target) { return !array_of(target).empty(); });
    return displaced ? values : std::vector<Vector>{};
}

/// Applies morph targets (glTF 2.0 §3.7.2.2; missing weights are 0, colours are clamped) and, if
/// `skin` is given, joints (§3.7.3.3). Skinning is linear blend skinning with all joint sets. The
/// weights are scaled to add up to 1; if all weights are 0, the first joint gets weight 1. Normals
/// are transformed by the inverse transpose. Vertices are processed in parallel; the result does
/// not depend on their order.
DeformedVertices deformedVertices(const Primitive& primitive, std::span<const double> weights,
                                  const JointMatrices* skin) {
    DeformedVertices result{primitive.positions, primitive.normals, primitive.tangents};
    for (std::size_t set = 0; set < result.texcoords.size(); ++set)
        result.texcoords[set] = ifDisplaced(
            primitive.texcoords[set],
            primitive.targets, [&](const MorphTarget& target) -> const auto& {
                return target.texcoords[set];
            });
    result.colors = ifDisplaced(
        primitive.colors, primitive.targets,
        [](const MorphTarget& target) -> const auto& { return target.colors; });
    for (std::size_t i = 0; i < std::min(primitive.targets.size(), weights.size()); ++i) {
        if (weights[i] == 0) continue;
        const MorphTarget& target = primitive.targets[i];
        displace(result.positions, target.positions, weights[i]);
        displace(result.normals, target.normals, weights[i]);
        displace(result.tangents, target.tangents, weights[i]);
        for (std::size_t set = 0; set < result.texcoords.size(); ++set)
            displace(result.texcoords[set], target.texcoords[set], weights[i]);
        displace(result.colors, target.colors, weights[i]);
    }
    for (glm::vec4& color : result.colors)
        color = glm::clamp(color, 0.0F, 1.0F);
    if (skin) applySkin(primitive, *skin, result);
    return result;
}

}  // namespace

glm::dmat3 normalMatrix(const glm::dmat3& m) {
    const glm::dmat3 cofactors(glm::cross(m[1], m[2]), glm::cross(m[2], m[0]),
                               glm::cross(m[0], m[1]));
    return glm::determinant(m) < 0 ? -cofactors : cofactors;
}

namespace {

struct Visit {
    int node = 0;
    glm::dmat4 world{1};
    bool visible = true;
};

/// Calls body(visit) for `roots` and all nodes below them, parents first, in file order. `to_world`
/// is the parent transform of the roots.
template <class Body>
void walk(const Scene& scene, const Pose& pose, const std::vector<int>& roots,
          const glm::dmat4& to_world, const Body& body) {
    // The stack is explicit because nesting depth is unlimited. It is last in, first out, so
    // children are pushed in reverse order.
    std::vector<Visit> stack;
    const auto push = [&](const std::vector<int>& nodes, const glm::dmat4& world, bool visible) {
        for (auto node = nodes.rbegin(); node != nodes.rend(); ++node)
            stack.push_back({*node, world, visible});
    };
    push(roots, to_world, true);
    while (!stack.empty()) {
        Visit visit = stack.back();
        stack.pop_back();
        const auto index = static_cast<std::size_t>(visit.node);
        const Node& node = scene.nodes[index];
        visit.world = visit.world * pose.locals[index];
        visit.visible = visit.visible && node.visible;
        body(visit);
        push(node.children, visit.world, visit.visible);
    }
}

/// Returns the world matrices of all nodes of the file, since joints may be outside the displayed
/// scene.
std::vector<glm::dmat4> worldsOf(const Scene& scene, const Pose& pose, const glm::dmat4& to_world) {
    std::vector<glm::dmat4> worlds(scene.nodes.size(), glm::dmat4(1));
    walk(scene, pose, rootsOf(scene.nodes), to_world,
         [&](const Visit& visit) { worlds[static_cast<std::size_t>(visit.node)] = visit.world; });
    return worlds;
}

bool isMirrored(const glm::dmat4& matrix) {
    return glm::determinant(glm::dmat3(matrix)) < 0;
}

}  // namespace

void placeNodes(const Scene& scene, int index, std::span<const PlacedNode> nodes, Pose& pose) {
    std::vector<int> parents(scene.nodes.size(), -1);
    for (std::size_t i = 0; i < scene.nodes.size(); ++i)
        for (const int child : scene.nodes[i].children)
            parents[static_cast<std::size_t>(child)] = static_cast<int>(i);
    const glm::dmat4& to_world = scene.scenes[static_cast<std::size_t>(index)].to_world;
    const std::vector<glm::dmat4> worlds = worldsOf(scene, pose, to_world);
    for (const PlacedNode& placed : nodes) {
        const auto node = static_cast<std::size_t>(placed.node);
        const glm::dmat4& world = worlds[node];
        const glm::dmat4 parent =
            parents[node] < 0 ? to_world : worlds[static_cast<std::size_t>(parents[node])];
        const auto place = rigid(world);
        if (!place || glm::determinant(glm::dmat3(parent)) == 0)
            throw Error(ErrorKind::kInput,
                        "the node has a degenerate transform, so it cannot be placed",
                        "/nodes/" + std::to_string(placed.node), "look for a scale of 0");
        const glm::dmat4 scale = glm::inverse(*place) * world;
        pose.locals[node] = glm::inverse(parent) * placed.to_world * scale;
    }
}

/// Collects instances and deforms their meshes.
class PosedScene::Builder {
  public:
    Builder(const Scene& scene, const Pose& pose, const glm::dmat4& to_world, Shown& shown)
        : scene_(scene), pose_(pose), to_world_(to_world), shown_(shown) {}

    void add(const Visit& visit) {
        const Node& node = scene_.nodes[static_cast<std::size_t>(visit.node)];
        if (node.camera >= 0)
            // Cameras are never hidden.
            shown_.cameras.push_back({visit.node, node.camera, visit.world});
        if (!visit.visible) return;
        if (node.mesh >= 0) addMesh(node, visit);
        if (node.light >= 0) shown_.lights.push_back({visit.node, node.light, visit.world});
    }

  private:
    void addMesh(const Node& node, const Visit& visit) {
        MeshInstance instance{visit.node, node.mesh, visit.world, isMirrored(visit.world)};
        if (node.skin >= 0) {
            deform(node, &place(node, instance), instance);
            shown_.meshes.push_back(instance);
            return;
        }
        deform(node, nullptr, instance);
        if (!node.instances) {
            shown_.meshes.push_back(instance);
            return;
        }
        for (const glm::dmat4& local : *node.instances) {
            instance.world = visit.world * local;
            instance.mirrored = isMirrored(instance.world);
            shown_.meshes.push_back(instance);
        }
    }

    /// Places a skinned mesh at its joints. Deformed vertices are floats. They are relative to the
    /// first joint, so that they stay precise far from the origin.
    const JointMatrices& place(const Node& node, MeshInstance& instance) {
        const Skin& skin = scene_.skins[static_cast<std::size_t>(node.skin)];
        if (worlds_.empty()) worlds_ = worldsOf(scene_, pose_, to_world_);
        const auto worldOf = [&](std::size_t joint) -> const glm::dmat4& {
            return worlds_[static_cast<std::size_t>(skin.joints[joint])];
        };
        const glm::dvec3 anchor(worldOf(0)[3]);
        const glm::dmat4 to_anchor = glm::translate(glm::dmat4(1), -anchor);
        const auto [entry, fresh] = skins_.try_emplace(node.skin);
        JointMatrices& matrices = entry->second;
        if (fresh)
            for (std::size_t i = 0; i < skin.joints.size(); ++i)
                matrices.joints.push_back(to_anchor * worldOf(i) * skin.inverse_bind[i]);
        matrices.unskinned = to_anchor * instance.world;
        instance.world = glm::translate(glm::dmat4(1), anchor);
        // Joints can mirror a mesh, as nodes can. The joints of the first vertex decide. If only
        // some joints mirror, neither answer is correct for the whole mesh.
        const auto& primitives = scene_.meshes[static_cast<std::size_t>(node.mesh)].primitives;
        instance.mirrored =
            !primitives.empty() && isMirrored(skinMatrix(primitives.front(), matrices, 0));
        return matrices;
    }

    void deform(const Node& node, const JointMatrices* joints, MeshInstance& instance) {
        const Mesh& mesh = scene_.meshes[static_cast<std::size_t>(node.mesh)];
        const bool morphs =
            std::any_of(mesh.primitives.begin(), mesh.primitives.end(),
                        [](const Primitive& primitive) { return !primitive.targets.empty(); });
        if (!joints && !morphs) return;
        const auto animated = pose_.weights.find(instance.node);
        const std::vector<double>& weights = animated != pose_.weights.end() ? animated->second
                                             : node.weights                  ? *node.weights
                                                                             : mesh.weights;
        instance.deformed = static_cast<int>(shown_.deformed.size());
        DeformedMesh& deformed = shown_.deformed.emplace_back();
        for (const Primitive& primitive : mesh.primitives)
            deformed.push_back(deformedVertices(primitive, weights, joints));
    }

    const Scene& scene_;
    const Pose& pose_;
    const glm::dmat4& to_world_;  ///< parent transform of the scene's roots
    /// World matrices of all nodes; empty until a skin needs them.
    std::vector<glm::dmat4> worlds_;
    std::map<int, JointMatrices> skins_;  ///< joint matrices, by skin index
    Shown& shown_;
};

PosedScene::PosedScene(const Scene& scene, int index, const Pose& pose)
    : shown_(std::make_shared<Shown>(scene)) {
    if (index < 0 || static_cast<std::size_t>(index) >= scene.scenes.size())
        throw Error(ErrorKind::kUsage, "there is no scene " + std::to_string(index), "",
                    "the number of scenes is " + std::to_string(scene.scenes.size()));
    const SceneRoots& shows = scene.scenes[static_cast<std::size_t>(index)];
    Builder builder(scene, pose, shows.to_world, *shown_);
    walk(scene, pose, shows.roots, shows.to_world, [&](const Visit& visit) { builder.add(visit); });
}

PosedScene::PosedScene(const Scene& scene, int index) : PosedScene(scene, index, restPose(scene)) {}

const DrawList& PosedScene::drawList() const {
    std::call_once(shown_->listed,
                   [this] { shown_->draw_list.emplace(shown_->scene, shown_->meshes); });
    return *shown_->draw_list;
}

template <class ArrayOf>
const auto& PosedScene::arrayOf(const Geometry& geometry, const ArrayOf& array_of) const {
    if (geometry.deformed >= 0) {
        const auto& moved =
            array_of(deformed()[static_cast<std::size_t>(geometry.deformed)][geometry.primitive]);
        if (!moved.empty()) return moved;
    }
    const Mesh& mesh = scene().meshes[static_cast<std::size_t>(geometry.mesh)];
    return array_of(mesh.primitives[geometry.primitive]);
}

const std::vector<glm::vec3>& PosedScene::positions(const Geometry& geometry) const {
    return arrayOf(
        geometry, [](const auto& v) -> const auto& { return v.positions; });
}

const std::vector<glm::vec3>& PosedScene::normals(const Geometry& geometry) const {
    return arrayOf(
        geometry, [](const auto& v) -> const auto& { return v.normals; });
}

const std::vector<glm::vec4>& PosedScene::tangents(const Geometry& geometry) const {
    return arrayOf(
        geometry, [](const auto& v) -> const auto& { return v.tangents; });
}

const std::vector<glm::vec2>& PosedScene::texcoords(const Geometry& geometry, int set) const {
    return arrayOf(
        geometry, [set](const auto& v) -> const auto& {
            return v.texcoords[static_cast<std::size_t>(set)];
        });
}

const std::vector<glm::vec4>& PosedScene::colors(const Geometry& geometry) const {
    return arrayOf(
        geometry, [](const auto& v) -> const auto& { return v.colors; });
}

const std::vector<glm::vec3>& PosedScene::positions(const MeshInstance& instance,
                                                    std::size_t primitive) const {
    return positions({instance.mesh, primitive, instance.deformed});
}

const std::vector<glm::vec3>& PosedScene::normals(const MeshInstance& instance,
                                                  std::size_t primitive) const {
    return normals({instance.mesh, primitive, instance.deformed});
}

std::vector<std::uint32_t> PosedScene::instanceOrdinals() const {
    std::vector<std::uint32_t> ordinals;
    for (const MeshInstance& instance : meshes()) {
        const bool more = !ordinals.empty() && meshes()[ordinals.size() - 1].node == instance.node;
        ordinals.push_back(more ? ordinals.back() + 1 : 0);
    }
    return ordinals;
}

bool PosedScene::hasTintedGlass() const {
    const auto tints = [this](const Primitive& p) {
        const Material& material = scene().materials[static_cast<std::size_t>(p.material)];
        return isTintedGlass(material) || (isTransmissive(material) && !p.colors.empty());
    };
    return std::ranges::any_of(meshes(), [&](const MeshInstance& instance) {
        return std::ranges::any_of(primitives(instance), tints);
    });
}

std::optional<Bounds> PosedScene::bounds() const {
    std::optional<Bounds> result;
    for (const MeshInstance& instance : meshes()) {
        for (std::size_t i = 0; i < primitives(instance).size(); ++i) {
            for (const glm::vec3& position : positions(instance, i)) {
                const glm::dvec3 point(instance.world * glm::dvec4(position, 1));
                if (!result) result = Bounds{point, point};
                result->min = glm::min(result->min, point);
                result->max = glm::max(result->max, point);
            }
        }
    }
    return result;
}

double PosedScene::reach(const glm::dvec3& origin, const glm::dvec3& direction) const {
    double farthest = -std::numeric_limits<double>::infinity();
    for (const MeshInstance& instance : meshes()) {
        // Transforms the direction to the space of the mesh. This is faster than transforming every
        // vertex to world space.
        const glm::dvec3 local = glm::transpose(glm::dmat3(instance.world)) * direction;
        const double offset = glm::dot(glm::dvec3(instance.world[3]) - origin, direction);
        for (std::size_t i = 0; i < primitives(instance).size(); ++i)
            for (const glm::vec3& position : positions(instance, i))
                farthest = std::max(farthest, glm::dot(local, glm::dvec3(position)) + offset);
    }
    return farthest;
}

}  // namespace peeler
