// SPDX-License-Identifier: Apache-2.0
// Validation of scenes built in code, with the checks that readers apply to files.
#include <algorithm>
#include <string>
#include <utility>
#include <vector>

#include <peeler/error.h>
#include <peeler/scene.h>
#include "core/scene/material.h"

namespace peeler::inline v0 {
namespace {

[[noreturn]] void refuse(const std::string& what, const std::string& where) {
    throw Error(ErrorKind::kUsage, what, where);
}

std::string placeOf(const char* list, std::size_t index) {
    return "/" + std::string(list) + "/" + std::to_string(index);
}

/// Throws Error (kUsage) if the index is invalid. With `none`, −1 is valid, too.
void checkIndex(std::int64_t index, std::size_t size, bool none, const char* of,
                const std::string& where) {
    if ((none && index == -1) || (index >= 0 && static_cast<std::uint64_t>(index) < size)) return;
    refuse("there is no " + std::string(of) + " " + std::to_string(index) + "; there are " +
               std::to_string(size),
           where);
}

void checkLength(std::size_t length, std::size_t vertices, const char* of,
                 const std::string& where) {
    if (length == 0 || length == vertices) return;
    refuse("expected " + std::to_string(vertices) + " " + of + ", one per vertex, not " +
               std::to_string(length),
           where);
}

void checkSplats(const Primitive& primitive, const std::string& where) {
    const Splats& splats = *primitive.splats;
    if (primitive.topology != Topology::kPoints || !primitive.indices.empty())
        refuse("splats are points without indices", where);
    if (splats.degree < 0 || splats.degree > 3) refuse("the degree is outside 0 to 3", where);
    const std::size_t count = primitive.positions.size();
    if (splats.size() != count || splats.scales.size() != count ||
        splats.rotations.size() != count ||
        splats.harmonics.size() != count * splats.coefficients())
        refuse("every splat needs a scale, a rotation, an opacity and harmonics", where);
}

void checkPrimitive(const Scene& scene, const Primitive& primitive, const std::string& where) {
    const std::size_t vertices = primitive.positions.size();
    checkIndex(primitive.material, scene.materials.size(), false, "material", where);
    for (const int material : primitive.variants)
        checkIndex(material, scene.materials.size(), true, "material", where);
    if (primitive.splats) checkSplats(primitive, where);
    checkLength(primitive.normals.size(), vertices, "normals", where);
    checkLength(primitive.tangents.size(), vertices, "tangents", where);
    checkLength(primitive.colors.size(), vertices, "colors", where);
    for (const glm::vec4& color : primitive.colors)
        if (color != glm::clamp(color, 0.0F, 1.0F)) refuse("a colour is outside 0 to 1", where);
    for (const auto& texcoords : primitive.texcoords)
        checkLength(texcoords.size(), vertices, "texcoords", where);
    for (const JointSet& set : primitive.joint_sets) {
        if (set.joints.size() != vertices || set.weights.size() != vertices)
            refuse("every vertex needs joints and weights", where);
    }
    for (const MorphTarget& target : primitive.targets) {
        checkLength(target.positions.size(), vertices, "positions of a target", where);
        checkLength(target.normals.size(), vertices, "normals of a target", where);
        checkLength(target.tangents.size(), vertices, "tangents of a target", where);
        for (const auto& texcoords : target.texcoords)
            checkLength(texcoords.size(), vertices, "texcoords of a target", where);
        checkLength(target.colors.size(), vertices, "colors of a target", where);
    }
    const auto largest = std::ranges::max_element(primitive.indices);
    if (largest != primitive.indices.end())
        checkIndex(*largest, vertices, false, "vertex", where + ", indices");
    if (primitive.topology == Topology::kTriangles || primitive.topology == Topology::kLines) {
        const std::size_t corners = primitive.topology == Topology::kTriangles ? 3 : 2;
        const std::size_t listed = primitive.indices.empty() ? vertices : primitive.indices.size();
        if (listed % corners != 0) {
            refuse(std::to_string(listed) + " corners do not make whole " +
                       (corners == 3 ? "triangles" : "lines"),
                   where);
        }
    }
}

void checkMeshes(const Scene& scene) {
    for (std::size_t m = 0; m < scene.meshes.size(); ++m) {
        const Mesh& mesh = scene.meshes[m];
        for (std::size_t p = 0; p < mesh.primitives.size(); ++p) {
            const std::string where = placeOf("meshes", m) + placeOf("primitives", p);
            checkPrimitive(scene, mesh.primitives[p], where);
            if (mesh.primitives[p].targets.size() != mesh.primitives[0].targets.size())
                refuse("all primitives of a mesh must have the same number of targets", where);
        }
    }
}

void checkMaterials(const Scene& scene) {
    if (scene.materials.empty()) refuse("there are no materials; the default one is needed", "");
    for (std::size_t m = 0; m < scene.materials.size(); ++m) {
        // Copies the material, since texturesOf() needs a mutable one.
        Material material = scene.materials[m];
        for (const MaterialTexture& texture : texturesOf(material)) {
            if (texture.ref)
                checkIndex(texture.ref->image, scene.images.size(), true, "image",
                           placeOf("materials", m));
        }
    }
    for (std::size_t i = 0; i < scene.images.size(); ++i) {
        const Image& image = scene.images[i];
        if (image.width < 0 || image.height < 0 ||
            image.rgba.size() != std::size_t{4} * static_cast<std::size_t>(image.width) *
                                     static_cast<std::size_t>(image.height))
            refuse("an image must have 4 bytes per pixel", placeOf("images", i));
    }
}

void checkSkins(const Scene& scene) {
    for (std::size_t s = 0; s < scene.skins.size(); ++s) {
        const Skin& skin = scene.skins[s];
        if (skin.joints.empty() || skin.joints.size() != skin.inverse_bind.size())
            refuse("a skin must have joints, and one matrix per joint", placeOf("skins", s));
        for (const int joint : skin.joints)
            checkIndex(joint, scene.nodes.size(), false, "node", placeOf("skins", s));
    }
    for (std::size_t n = 0; n < scene.nodes.size(); ++n) {
        const Node& node = scene.nodes[n];
        if (node.skin < 0 || node.mesh < 0) continue;
        const std::size_t joints = scene.skins[static_cast<std::size_t>(node.skin)].joints.size();
        for (const Primitive& p : scene.meshes[static_cast<std::size_t>(node.mesh)].primitives)
            for (const JointSet& set : p.joint_sets)
                for (const glm::u16vec4& four : set.joints)
                    for (int i = 0; i < 4; ++i)
                        checkIndex(four[i], joints, false, "joint", placeOf("nodes", n));
    }
}

void checkNodes(const Scene& scene) {
    std::vector<char> has_parent(scene.nodes.size(), 0);
    for (std::size_t n = 0; n < scene.nodes.size(); ++n) {
        const Node& node = scene.nodes[n];
        const std::string where = placeOf("nodes", n);
        checkIndex(node.mesh, scene.meshes.size(), true, "mesh", where);
        checkIndex(node.skin, scene.skins.size(), true, "skin", where);
        checkIndex(node.camera, scene.cameras.size(), true, "camera", where);
        checkIndex(node.light, scene.lights.size(), true, "light", where);
        for (const int child : node.children) {
            checkIndex(child, scene.nodes.size(), false, "node", where);
            if (std::exchange(has_parent[static_cast<std::size_t>(child)], 1))
                refuse("node " + std::to_string(child) + " has two parents", where);
        }
    }
    // No node has two parents, so nodes that cannot be reached from any root form a cycle.
    std::vector<int> reached = rootsOf(scene.nodes);
    for (std::size_t i = 0; i < reached.size(); ++i) {
        const auto& children = scene.nodes[static_cast<std::size_t>(reached[i])].children;
        reached.insert(reached.end(), children.begin(), children.end());
    }
    if (reached.size() != scene.nodes.size()) refuse("a node is its own ancestor", "/nodes");
}

void checkAnimations(const Scene& scene) {
    for (std::size_t a = 0; a < scene.animations.size(); ++a) {
        const Animation& animation = scene.animations[a];
        const std::string where = placeOf("animations", a);
        for (const AnimationChannel& channel : animation.channels) {
            checkIndex(static_cast<std::int64_t>(channel.keyframes), animation.keyframes.size(),
                       false, "list of keyframes", where);
            checkIndex(channel.node, scene.nodes.size(), false, "node", where);
            const Keyframes& keys = animation.keyframes[channel.keyframes];
            const std::size_t tangents = keys.interpolation == Interpolation::kCubicSpline ? 3 : 1;
            const std::size_t numbers = channel.property == AnimatedProperty::kRotation  ? 4
                                        : channel.property == AnimatedProperty::kWeights ? 1
                                                                                         : 3;
            if (keys.times.empty() || !std::ranges::is_sorted(keys.times))
                refuse("the times of keyframes must increase", where);
            if (keys.values.size() < keys.times.size() * tangents * numbers)
                refuse("there are fewer values than keyframes", where);
        }
    }
}

}  // namespace

void checkScene(const Scene& scene) {
    if (scene.scenes.empty()) refuse("there is no list of roots", "/scenes");
    checkIndex(scene.default_scene, scene.scenes.size(), false, "scene", "/scene");
    for (std::size_t s = 0; s < scene.scenes.size(); ++s)
        for (const int root : scene.scenes[s].roots)
            checkIndex(root, scene.nodes.size(), false, "node", placeOf("scenes", s));
    checkMaterials(scene);
    checkMeshes(scene);
    checkNodes(scene);
    checkSkins(scene);
    checkAnimations(scene);
}

}  // namespace peeler::inline v0
