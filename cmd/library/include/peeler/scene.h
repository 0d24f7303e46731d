// SPDX-License-Identifier: Apache-2.0
// Scene data: nodes, meshes, images, cameras, lights, skins, animations.
#pragma once

#include <array>
#include <cstdint>
#include <filesystem>
#include <glm/glm.hpp>
#include <glm/gtc/quaternion.hpp>
#include <memory>
#include <optional>
#include <string>
#include <utility>
#include <vector>

#include <peeler/material.h>
#include <peeler/text.h>

#pragma GCC visibility push(default)

namespace peeler::inline v0 {

/// Primitive modes, with the values of OpenGL and glTF (GL_POINTS = 0 … GL_TRIANGLE_FAN = 6).
enum class Topology : std::uint8_t {
    kPoints,
    kLines,
    kLineLoop,
    kLineStrip,
    kTriangles,
    kTriangleStrip,
    kTriangleFan
};

/// An 8-bit RGBA image with straight (unassociated) alpha as stored in the file, rows top to
/// bottom.
struct Image {
    std::string name;
    int width = 0, height = 0;
    std::vector<std::uint8_t> rgba;
    std::string codec{};  ///< the file format, for display: "PNG"; "" = not read from a file
};

/// An environment light: an equirectangular (latitude-longitude) image of linear radiance, rows top
/// to bottom. The orientation is that of OpenEXR's ImfEnvmap.h: +Z at the centre, +Y at the top,
/// and +X a quarter of the width to the left of the centre.
struct Environment {
    int width = 0, height = 0;
    std::vector<glm::vec3> radiance;  ///< per pixel; finite, not negative
    double rotation = 0;              ///< radians about +Y; positive turns +Z toward +X
    std::uint64_t content_hash = 0;
    /// Whether this is the built-in environment, whose maps are part of the program.
    bool is_studio = false;
};

/// Up to four joints per vertex, and the joints' weights (JOINTS_n, WEIGHTS_n).
struct JointSet {
    std::vector<glm::u16vec4> joints;  ///< indices into Skin::joints
    std::vector<glm::vec4> weights;    ///< the weights of a vertex over all sets should add up to 1
};

/// Vertex displacements at weight 1. Each array may be empty.
struct MorphTarget {
    std::vector<glm::vec3> positions, normals, tangents;
    std::array<std::vector<glm::vec2>, 2> texcoords{};
    std::vector<glm::vec4> colors{};
};

/// The location of a primitive in its file, used to add data to the file.
struct PrimitiveSource {
    std::size_t primitive = 0;  ///< index within the mesh in the file
    /// Index in the file of the first vertex that is kept.
    std::size_t first_vertex = 0;
    std::size_t vertices = 0;  ///< number of vertices in the file, after decoding
};

/// The properties of Gaussian splats (Kerbl et al., "3D Gaussian Splatting for Real-Time Radiance
/// Field Rendering", 2023; glTF's KHR_gaussian_splatting), one entry per splat in each array. The
/// splats' means are the positions of the primitive, which is of points.
struct Splats {
    std::vector<glm::vec3> scales;  ///< standard deviations along the splat's own axes, at least 0
    std::vector<glm::vec4>
        rotations;  ///< from the splat's axes to the mesh: unit quaternions x, y, z, w
    std::vector<float> opacities;  ///< 0 to 1
    /// Spherical harmonics of the colour in mesh space, with the signs of KHR_gaussian_splatting:
    /// (degree + 1)² coefficients of red, green and blue per splat, by degree, then by order.
    std::vector<glm::vec3> harmonics;
    int degree = 0;            ///< 0 to 3
    bool linear = false;       ///< whether colours are linear instead of sRGB
    double dilation = 0;       ///< variance added to the projected splat, square pixels
    bool compensated = false;  ///< whether the dilated splat's opacity is reduced (Mip-Splatting)
    bool by_distance = false;  ///< whether SplatOrder::kCenter sorts by distance instead of Z

    std::size_t size() const { return opacities.size(); }
    /// Returns the number of coefficients of a degree, per splat.
    static std::size_t coefficients(int degree) {
        const auto orders = static_cast<std::size_t>(degree) + 1;
        return orders * orders;
    }
    std::size_t coefficients() const { return coefficients(degree); }
};

/// A draw primitive: vertex arrays of equal length (empty if missing in the file) and an index list
/// (empty = the vertices in order). Readers check that every index is in range.
struct Primitive {
    Topology topology = Topology::kTriangles;
    int material = 0;  ///< index into Scene::materials, always valid
    /// The material's index for each of Scene::variants; −1 = `material`.
    std::vector<int> variants;
    std::vector<glm::vec3> positions;
    std::vector<glm::vec3> normals;
    std::vector<glm::vec4> tangents;  ///< w = handedness ±1
    std::array<std::vector<glm::vec2>, 2> texcoords;
    std::vector<glm::vec4> colors;  ///< linear, straight alpha, 0 to 1
    std::vector<std::uint32_t> indices;
    std::vector<JointSet> joint_sets;
    /// Morph targets; all primitives of a mesh have the same number.
    std::vector<MorphTarget> targets;
    PrimitiveSource source{};
    /// If set, the points are Gaussian splats.
    std::shared_ptr<const Splats> splats{};
};

struct Mesh {
    std::string name;
    std::vector<Primitive> primitives;
    std::vector<double> weights{};  ///< at rest; empty = zeros
};

/// A skin (glTF 2.0 §3.7.3).
struct Skin {
    std::string name;
    std::vector<int> joints;  ///< indices of the joints' nodes, at least one
    /// The transform from mesh space to joint space at rest, one per joint.
    std::vector<glm::dmat4> inverse_bind;
};

/// A glTF camera (§3.10). Looks along −Z of its node.
struct Camera {
    std::string name;
    bool perspective = true;
    double yfov = 0.8;  ///< vertical field of view, radians; perspective only
    /// Width / height; perspective only; none = the picture's aspect ratio.
    std::optional<double> aspect_ratio;
    double xmag = 1, ymag = 1;  ///< half extents, scene units; orthographic only
    double znear = 0.01;
    std::optional<double> zfar;  ///< distance to the far plane; none = infinite
};

enum class LightType : std::uint8_t { kDirectional, kPoint, kSpot };

/// A punctual light (KHR_lights_punctual). Shines along −Z of its node; the node's scale has no
/// effect.
struct Light {
    std::string name;
    LightType type = LightType::kDirectional;
    glm::dvec3 color{1};          ///< linear
    double intensity = 1;         ///< lux for directional lights, candela for other lights
    std::optional<double> range;  ///< scene units, none = infinite; point and spot lights only
    /// Half angles of the cones, radians; spot lights only.
    double inner_cone = 0, outer_cone = 0.7853981633974483;
};

/// A node transform as glTF animates it: matrix() = translation · rotation · scale.
struct Trs {
    glm::dvec3 translation{0};
    glm::dquat rotation{1, 0, 0, 0};  ///< of any length; all zeros = no rotation
    glm::dvec3 scale{1};

    glm::dmat4 matrix() const;
};

/// A node of the hierarchy. An index of −1 means none.
struct Node {
    std::string name;
    std::vector<int> children;
    glm::dmat4 local{1};  ///< relative to the parent, at rest
    /// The parts of `local`; none = `local` is given as a matrix, which cannot be animated.
    std::optional<Trs> trs;
    int mesh = -1;
    int skin = -1;  ///< index of the skin that deforms the mesh; replaces the node's transform
    int camera = -1;
    int light = -1;
    bool visible = true;  ///< false hides the meshes and lights of the node and its descendants
    std::optional<std::vector<double>> weights;  ///< replace the mesh's morph target weights
    /// EXT_mesh_gpu_instancing: the transform of each instance, relative to the node; none = a
    /// single instance at the node.
    std::optional<std::vector<glm::dmat4>> instances;
    /// glTF's `extras`: keys and values (strings, numbers and booleans) as text.
    std::vector<std::pair<std::string, std::string>> extras{};
};

enum class Interpolation : std::uint8_t { kStep, kLinear, kCubicSpline };

/// Values over time: a glTF animation sampler (glTF 2.0 §3.11).
struct Keyframes {
    Interpolation interpolation = Interpolation::kLinear;
    std::vector<float> times;  ///< seconds, never decreasing; at least one
    /// One value per time; for kCubicSpline three: in-tangent, value, out-tangent.
    std::vector<float> values;
};

/// The node properties that an animation can change.
enum class AnimatedProperty : std::uint8_t { kTranslation, kRotation, kScale, kWeights };

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

/// An entry of the glTF file's `scenes`: a list of root nodes.
struct SceneRoots {
    std::string name;
    std::vector<int> roots;
    glm::dmat4 to_world{1};  ///< transform of the roots; readers leave it at identity
};

/// The content of a scene file. Nodes, meshes and other objects refer to each other by index; all
/// indices are in range.
struct Scene {
    std::vector<SceneRoots> scenes;  ///< at least one
    int default_scene = 0;
    std::vector<Node> nodes;  ///< a forest: every node has at most one parent; no cycles
    std::vector<Mesh> meshes;
    std::vector<Material> materials;  ///< at least one; the last is glTF's default material
    std::vector<Image> images;
    std::vector<Camera> cameras;
    std::vector<Light> lights;
    std::vector<Skin> skins;
    std::vector<Animation> animations;
    std::vector<std::string> variants;  ///< names of the material variants (KHR_materials_variants)
    std::optional<Environment> environment;  ///< replaces the built-in light

    std::string generator, copyright;
    std::vector<std::string> extensions_used, extensions_required;
    std::uint64_t content_hash = 0;  ///< of all bytes that were read
    /// Files that the scene file refers to (buffers, images), including files that do not exist.
    /// Omits files outside the scene's folder unless GltfOptions::allow_outside is set.
    std::vector<std::filesystem::path> files;
    std::vector<Text> warnings;  ///< whole sentences, without duplicates
};

/// An axis-aligned box in world space.
struct Bounds {
    glm::dvec3 min{0}, max{0};
};

/// Throws Error (kUsage) if the scene is invalid: an index out of range, vertex arrays of unequal
/// length, a node with two parents. A Renderer calls this function for every scene. Scenes from
/// readers are valid.
void checkScene(const Scene& scene);

/// Returns a node's name, or "node 12" if it has no name.
std::string nodeName(const Scene& scene, std::size_t node);

/// Returns the nodes without a parent, in order.
std::vector<int> rootsOf(const std::vector<Node>& nodes);

/// Sets every primitive's material to that of a variant (an index into Scene::variants).
void chooseVariant(Scene& scene, std::size_t variant);

/// The names of objects and materials. The object or material with index i (also in the glTF file)
/// has id i + 1. Id 0 is unused.
struct IdNames {
    std::vector<std::string> objects;  ///< names of the nodes
    /// Names of the materials; the last is glTF's default material.
    std::vector<std::string> materials;
    /// The id of each object's parent; 0 = no parent. Empty = unknown.
    std::vector<std::uint32_t> parents{};

    bool empty() const { return objects.empty() && materials.empty(); }
    bool operator==(const IdNames&) const = default;
};

/// Returns the names of nodes and materials, and the nodes' parents. Unnamed nodes are called
/// nodeName(), unnamed materials "material 3" or "default material". Names need not be unique.
IdNames idNames(const Scene& scene);

}  // namespace peeler::inline v0

#pragma GCC visibility pop
