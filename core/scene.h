// SPDX-License-Identifier: Apache-2.0
// A scene as plain data: what a reader hands to the renderer. No file format's types here.
#pragma once

#include <array>
#include <cstdint>
#include <glm/glm.hpp>
#include <optional>
#include <string>
#include <vector>

#include "core/material.h"

namespace peeler {

/// The order and the numbers are those of OpenGL and glTF (GL_POINTS = 0 … GL_TRIANGLE_FAN = 6).
enum class Topology : std::uint8_t {
    kPoints,
    kLines,
    kLineLoop,
    kLineStrip,
    kTriangles,
    kTriangleStrip,
    kTriangleFan
};

/// 8-bit RGBA, straight (unassociated) alpha as stored in the file, rows top to bottom.
struct Image {
    std::string name;
    int width = 0, height = 0;
    std::vector<std::uint8_t> rgba;
};

/// Light from all around: an equirectangular image (latitude-longitude) of linear radiance, rows
/// top to bottom. As ImfEnvmap.h of OpenEXR defines it: the centre is seen along +Z, the top along
/// +Y, and what lies along +X is a quarter to the left of the centre.
struct Environment {
    int width = 0, height = 0;
    std::vector<glm::vec3> radiance;  ///< finite, not negative
    double rotation = 0;  ///< radians about +Y; a positive one turns what is along +Z toward +X
    std::uint64_t content_hash = 0;
};

/// Vertex arrays of equal length (or empty where the file has none), and an index list (or empty:
/// the vertices in order). Every index is in range; readers check that.
struct Primitive {
    Topology topology = Topology::kTriangles;
    int material = 0;  ///< index into Scene::materials, always valid
    std::vector<int>
        variants;  ///< by index into Scene::variants: the material then, −1 = `material`
    std::vector<glm::vec3> positions;
    std::vector<glm::vec3> normals;
    std::vector<glm::vec4> tangents;  ///< w = handedness ±1
    std::array<std::vector<glm::vec2>, 2> texcoords;
    std::vector<glm::vec4> colors;
    std::vector<std::uint32_t> indices;
};

struct Mesh {
    std::string name;
    std::vector<Primitive> primitives;
};

/// A glTF camera (§3.10). Looks along −Z of its node.
struct Camera {
    std::string name;
    bool perspective = true;
    double yfov = 0.8;                   ///< radians; perspective
    std::optional<double> aspect_ratio;  ///< width / height; perspective
    double xmag = 1, ymag = 1;           ///< half extents in scene units; orthographic
    double znear = 0.01;
    std::optional<double> zfar;  ///< none = infinite
};

enum class LightType : std::uint8_t { kDirectional, kPoint, kSpot };

/// A punctual light (KHR_lights_punctual). Shines along −Z of its node, whose scale has no effect.
struct Light {
    std::string name;
    LightType type = LightType::kDirectional;
    glm::dvec3 color{1};          ///< linear
    double intensity = 1;         ///< lux if directional, else candela
    std::optional<double> range;  ///< scene units, none = infinite; point and spot
    double inner_cone = 0, outer_cone = 0.7853981633974483;  ///< half angles, radians; spot
};

struct Node {
    std::string name;
    std::vector<int> children;
    glm::dmat4 local{1};
    int mesh = -1;
    int camera = -1;
    int light = -1;
};

/// One root list of the file's `scenes`.
struct SceneRoots {
    std::string name;
    std::vector<int> roots;
};

struct Scene {
    std::vector<SceneRoots> scenes;  ///< at least one
    int default_scene = 0;
    std::vector<Node> nodes;  ///< a forest: every node has at most one parent, no cycles
    std::vector<Mesh> meshes;
    std::vector<Material> materials;  ///< at least one; the last is glTF's default material
    std::vector<Image> images;
    std::vector<Camera> cameras;
    std::vector<Light> lights;
    std::vector<std::string> variants;       ///< names (KHR_materials_variants)
    std::optional<Environment> environment;  ///< in place of the built-in light

    std::string generator, copyright;
    std::vector<std::string> extensions_used, extensions_required;
    std::uint64_t content_hash = 0;     ///< of all bytes that were read
    std::vector<std::string> warnings;  ///< whole sentences, each once
};

/// A mesh in its place. `world` is the product of the node matrices from the root.
struct MeshInstance {
    int node = 0;
    int mesh = 0;
    glm::dmat4 world{1};
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
};

/// Gives every primitive its material of a variant (an index into Scene::variants).
void chooseVariant(Scene& scene, std::size_t variant);

/// What one of the scenes shows, depth first: the draw order.
struct SceneContents {
    std::vector<MeshInstance> meshes;
    std::vector<CameraInstance> cameras;
    std::vector<LightInstance> lights;
};
SceneContents contents(const Scene& scene, int scene_index);

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
