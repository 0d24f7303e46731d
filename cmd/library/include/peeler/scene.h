// SPDX-License-Identifier: Apache-2.0
// A scene as plain data: nodes, meshes, images, cameras, lights, skins, animations.
#pragma once

#include <array>
#include <cstdint>
#include <filesystem>
#include <glm/glm.hpp>
#include <glm/gtc/quaternion.hpp>
#include <optional>
#include <string>
#include <utility>
#include <vector>

#include <peeler/material.h>
#include <peeler/text.h>

#pragma GCC visibility push(default)

namespace peeler::inline v0 {

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
    std::string codec{};  ///< how the file has it, for people: "PNG"; "" = there is no file
};

/// Light from all around: an equirectangular image (latitude-longitude) of linear radiance, rows
/// top to bottom. As ImfEnvmap.h of OpenEXR defines it: the centre is seen along +Z, the top along
/// +Y, and what lies along +X is a quarter to the left of the centre.
struct Environment {
    int width = 0, height = 0;
    std::vector<glm::vec3> radiance;  ///< finite, not negative
    double rotation = 0;  ///< radians about +Y; a positive one turns what is along +Z toward +X
    std::uint64_t content_hash = 0;
    /// The built-in one, whose maps are part of the program.
    bool is_studio = false;
};

/// Up to four joints that move each vertex, and how much (JOINTS_n, WEIGHTS_n).
struct JointSet {
    std::vector<glm::u16vec4> joints;  ///< indices into Skin::joints
    std::vector<glm::vec4> weights;    ///< those of all sets together should add up to 1
};

/// Displacements of every vertex at weight 1; each array may be empty.
struct MorphTarget {
    std::vector<glm::vec3> positions, normals, tangents;
    std::array<std::vector<glm::vec2>, 2> texcoords{};
    std::vector<glm::vec4> colors{};
};

/// Where a primitive stands in its file, for those who add to it.
struct PrimitiveSource {
    std::size_t primitive = 0;     ///< of the file's mesh
    std::size_t first_vertex = 0;  ///< of the file's vertices those before are not kept
    std::size_t vertices = 0;      ///< the file's, decoded
};

/// Vertex arrays of equal length (or empty where the file has none), and an index list (or empty:
/// the vertices in order). Every index is in range; readers check that.
struct Primitive {
    Topology topology = Topology::kTriangles;
    int material = 0;  ///< index into Scene::materials, always valid
    /// By index into Scene::variants: the material then; −1 = `material`.
    std::vector<int> variants;
    std::vector<glm::vec3> positions;
    std::vector<glm::vec3> normals;
    std::vector<glm::vec4> tangents;  ///< w = handedness ±1
    std::array<std::vector<glm::vec2>, 2> texcoords;
    std::vector<glm::vec4> colors;  ///< linear, straight alpha, 0 to 1
    std::vector<std::uint32_t> indices;
    std::vector<JointSet> joint_sets;
    std::vector<MorphTarget> targets;  ///< as many in every primitive of a mesh
    PrimitiveSource source{};
};

/// Primitives that are placed together.
struct Mesh {
    std::string name;
    std::vector<Primitive> primitives;
    std::vector<double> weights{};  ///< of the morph targets at rest; may be empty: zeros
};

/// Bones for meshes (glTF 2.0 §3.7.3).
struct Skin {
    std::string name;
    std::vector<int> joints;               ///< nodes, at least one
    std::vector<glm::dmat4> inverse_bind;  ///< of each joint: from the mesh to the joint at rest
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

/// A node's place as glTF animates it: matrix() = translation · rotation · scale.
struct Trs {
    glm::dvec3 translation{0};
    glm::dquat rotation{1, 0, 0, 0};  ///< need not be of unit length; all zeros = none
    glm::dvec3 scale{1};

    glm::dmat4 matrix() const;
};

/// A place in the hierarchy, and what is there. Indices are −1 where there is nothing.
struct Node {
    std::string name;
    std::vector<int> children;
    glm::dmat4 local{1};     ///< at rest
    std::optional<Trs> trs;  ///< what `local` is made of; none = a matrix, which nothing animates
    int mesh = -1;
    int skin = -1;  ///< moves the mesh; the node's own place does not matter then
    int camera = -1;
    int light = -1;
    bool visible = true;  ///< false hides meshes and lights, those of descendants, too
    std::optional<std::vector<double>> weights;  ///< instead of the mesh's
    /// EXT_mesh_gpu_instancing: where the mesh is shown, relative to the node; none = once, at it.
    std::optional<std::vector<glm::dmat4>> instances;
    /// What its file says besides (glTF's extras), by key: texts, numbers and truth values, as
    /// text.
    std::vector<std::pair<std::string, std::string>> extras{};
};

enum class Interpolation : std::uint8_t { kStep, kLinear, kCubicSpline };

/// Values over time (glTF 2.0 §3.11).
struct Keyframes {
    Interpolation interpolation = Interpolation::kLinear;
    std::vector<float> times;   ///< seconds, never falling; at least one
    std::vector<float> values;  ///< a value a time; kCubicSpline: in-tangent, value, out-tangent
};

/// The property of a node that an animation changes.
enum class AnimatedProperty : std::uint8_t { kTranslation, kRotation, kScale, kWeights };

/// Keyframes, and the node and property that they change.
struct AnimationChannel {
    std::size_t keyframes = 0;  ///< index into Animation::keyframes
    int node = 0;
    AnimatedProperty property = AnimatedProperty::kTranslation;
};

struct Animation {
    std::string name;
    std::vector<Keyframes> keyframes;
    std::vector<AnimationChannel> channels;
};

/// One root list of the file's `scenes`.
struct SceneRoots {
    std::string name;
    std::vector<int> roots;
    glm::dmat4 to_world{1};  ///< where the roots are: what readers give is never moved or scaled
};

/// All that a file holds. Nodes, meshes and the like name each other by index; all are in range.
struct Scene {
    std::vector<SceneRoots> scenes;  ///< at least one
    int default_scene = 0;
    std::vector<Node> nodes;  ///< a forest: every node has at most one parent, no cycles
    std::vector<Mesh> meshes;
    std::vector<Material> materials;  ///< at least one; the last is glTF's default material
    std::vector<Image> images;
    std::vector<Camera> cameras;
    std::vector<Light> lights;
    std::vector<Skin> skins;
    std::vector<Animation> animations;
    std::vector<std::string> variants;       ///< names (KHR_materials_variants)
    std::optional<Environment> environment;  ///< in place of the built-in light

    std::string generator, copyright;
    std::vector<std::string> extensions_used, extensions_required;
    std::uint64_t content_hash = 0;  ///< of all bytes that were read
    /// What the scene's file names besides itself (buffers, images) and may read, read or not.
    std::vector<std::filesystem::path> files;
    std::vector<Text> warnings;  ///< whole sentences, each once
};

/// An axis-aligned box in world space.
struct Bounds {
    glm::dvec3 min{0}, max{0};
};

/// Throws Error (kUsage) for a scene that is none: an index that is out of range, an array of
/// another length than the others, a node with two parents. A Renderer does so with what it is
/// given; what readers give is in order.
void checkScene(const Scene& scene);

/// What a node is called: its own name, else "node 12".
std::string nodeName(const Scene& scene, std::size_t node);

/// The nodes that are no other node's child, in order.
std::vector<int> rootsOf(const std::vector<Node>& nodes);

/// Gives every primitive its material of a variant (an index into Scene::variants).
void chooseVariant(Scene& scene, std::size_t variant);

/// Names by id − 1. An id is an index into the glTF file plus 1; 0 is that of no fragment.
struct IdNames {
    std::vector<std::string> objects;    ///< nodes
    std::vector<std::string> materials;  ///< the last is glTF's default material
    /// The id of each object's parent, 0 = it has none. Empty if that is not known.
    std::vector<std::uint32_t> parents{};

    bool empty() const { return objects.empty() && materials.empty(); }
    bool operator==(const IdNames&) const = default;
};

/// What nodes and materials are called: their own names, else nodeName(), "material 3", "default
/// material". Names need not be unique. Parents are known.
IdNames idNames(const Scene& scene);

}  // namespace peeler::inline v0

#pragma GCC visibility pop
