// SPDX-License-Identifier: Apache-2.0
// Reader of the nodes of a glTF file (glTF 2.0 §3.5), their skins (§3.7.3) and instances
// (EXT_mesh_gpu_instancing).
#include "formats/gltf/gltf_parts.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <nlohmann/json.hpp>
#include <string>

#include <peeler/error.h>
#include "formats/file/json_text.h"
#include "formats/gltf/gltf_accessor.h"
#include "formats/gltf/gltf_schema.h"

namespace peeler {
namespace {

using nlohmann::json;

constexpr const char* kInstancing = "EXT_mesh_gpu_instancing";
constexpr const char* kVisibility = "KHR_node_visibility";

// The total memory per instance: the matrix, the entries in the scene and in the draw list, and the
// GPU data, in bytes.
constexpr std::uint64_t kInstanceBytes = 4 * sizeof(glm::dmat4);

const AccessorFormat kInstanceVector = {{3}, {{5126}}};
const AccessorFormat kInstanceRotation = {{4}, {{5126}, {5120, true}, {5122, true}}};

/// Converts a matrix, column-major as in glTF and GLM.
template <class Number>
glm::dmat4 matrixOf(const Number* values) {
    glm::dmat4 result(1);
    for (int column = 0; column < 4; ++column)
        for (int row = 0; row < 4; ++row)
            result[column][row] = static_cast<double>(*values++);
    return result;
}

/// Returns the extras whose value is a string, number or boolean (§3.2).
std::vector<std::pair<std::string, std::string>> scalarsOf(const json& extras) {
    std::vector<std::pair<std::string, std::string>> scalars;
    if (!extras.is_object()) return scalars;
    for (const auto& [key, value] : extras.items()) {
        if (value.is_string())
            scalars.emplace_back(key, value.get<std::string>());
        else if (value.is_number() || value.is_boolean())
            scalars.emplace_back(key, dumpJson(value));
    }
    return scalars;
}

/// Returns the number of joints that a mesh needs: the largest joint index with a non-zero weight,
/// plus one.
std::size_t jointsOf(const Mesh& mesh) {
    std::size_t end = 0;
    for (const Primitive& primitive : mesh.primitives)
        for (const JointSet& set : primitive.joint_sets)
            for (std::size_t i = 0; i < set.joints.size(); ++i)
                for (int k = 0; k < 4; ++k)
                    if (set.weights[i][k] != 0)
                        end = std::max(end, std::size_t{set.joints[i][k]} + 1);
    return end;
}

/// Returns the bytes of a primitive's texture coordinates and colours that morph targets displace.
std::uint64_t displacedBytes(const Primitive& primitive) {
    std::array<std::uint64_t, 3> most{};
    for (const MorphTarget& target : primitive.targets) {
        for (std::size_t set = 0; set < target.texcoords.size(); ++set)
            most[set] = std::max(most[set], target.texcoords[set].size() * sizeof(glm::vec2));
        most[2] = std::max(most[2], target.colors.size() * sizeof(glm::vec4));
    }
    return most[0] + most[1] + most[2];
}

class NodeReader {
  public:
    NodeReader(GltfDocument& document, const GltfOptions& options, Scene& scene)
        : document_(document),
          scene_(scene),
          accessors_(document),
          limit_("instances and deformed meshes need", options.max_geometry_bytes) {}

    void read() {
        for (std::size_t i = 0; i < document_.skins.size(); ++i)
            scene_.skins.push_back(skin(document_.skins[i], childPointer("/skins", i)));
        document_.memory.allow(document_.model.nodes.size() * sizeof(Node), "/nodes");
        scene_.nodes.reserve(document_.model.nodes.size());
        for (std::size_t i = 0; i < document_.model.nodes.size(); ++i)
            scene_.nodes.push_back(node(i, childPointer("/nodes", i)));
    }

  private:
    Node node(std::size_t index, const std::string& where) {
        const tinygltf::Node& source = document_.model.nodes[index];
        Node node;
        node.name = source.name;
        node.children = source.children;
        node.mesh = source.mesh;
        node.skin = source.mesh >= 0 ? source.skin : -1;
        node.camera = source.camera;
        node.light = document_.node_lights[index];
        place(source, where, node);
        if (!source.weights.empty()) node.weights = source.weights;
        readExtensions(document_.node_extensions[index], where + "/extensions", node);
        node.extras = scalarsOf(document_.node_extras[index]);
        document_.memory.allow(node.extras.size() * sizeof(node.extras.front()), where);
        checkSkin(node, where);
        checkWeights(node, where);
        takeBytes(deformedBytes(node), where);
        return node;
    }

    /// Reads the transform (§3.5.3): the matrix if there is one, else translation · rotation ·
    /// scale.
    void place(const tinygltf::Node& source, const std::string& where, Node& node) {
        if (!source.matrix.empty()) {
            node.local = matrixOf(source.matrix.data());
            return;
        }
        Trs trs;
        if (const auto& t = source.translation; !t.empty()) trs.translation = {t[0], t[1], t[2]};
        if (const auto& s = source.scale; !s.empty()) trs.scale = {s[0], s[1], s[2]};
        if (const auto& r = source.rotation; !r.empty()) {
            trs.rotation = glm::dquat(r[3], r[0], r[1], r[2]);
            if (!(glm::length(trs.rotation) > 0))
                document_.warn("The rotation of " + where + " is all zeros; it is ignored.");
        }
        node.local = trs.matrix();
        node.trs = trs;
    }

    void readExtensions(const json& extensions, const std::string& where, Node& node) {
        if (const auto found = extensions.find(kVisibility); found != extensions.end())
            node.visible = found->value("visible", true);
        const auto instancing = extensions.find(kInstancing);
        if (instancing == extensions.end() || node.mesh < 0) return;
        if (node.skin >= 0)
            document_.warn("The instances " + where +
                           " are ignored, because joints place the skinned mesh; the "
                           "mesh is shown once.");
        else
            node.instances =
                instances((*instancing)["attributes"], where + '/' + kInstancing + "/attributes");
    }

    std::vector<glm::dmat4> instances(const json& attributes, const std::string& where) {
        std::size_t count = 0;
        const char* first = nullptr;
        const auto values = [&](const char* name, const AccessorFormat& format) {
            const auto found = attributes.find(name);
            if (found == attributes.end()) return std::vector<float>{};
            const int accessor = found->get<int>();
            const std::size_t elements = accessors_.count(accessor);
            if (first && elements != count)
                failGltf("the attribute has " + std::to_string(elements) + " elements, but " +
                             first + " has " + std::to_string(count),
                         where + '/' + name);
            first = name;
            count = elements;
            takeBytes(count * kInstanceBytes, where + '/' + name);
            std::vector<float> numbers =
                accessors_.floats(accessor, format, {0, elements}, where + '/' + name);
            for (const float number : numbers)
                if (!std::isfinite(number))
                    failGltf("a value is not a finite number", where + '/' + name);
            return numbers;
        };
        const std::vector<float> translations = values("TRANSLATION", kInstanceVector);
        const std::vector<float> rotations = values("ROTATION", kInstanceRotation);
        const std::vector<float> scales = values("SCALE", kInstanceVector);
        if (!first) {
            document_.warn("The instances " + where + " have no transforms; the mesh is shown " +
                           "once, at its node.");
            return {glm::dmat4(1)};
        }
        std::vector<glm::dmat4> result(count);
        for (std::size_t i = 0; i < count; ++i) {
            Trs trs;
            for (int axis = 0; axis < 3; ++axis) {
                const std::size_t at = 3 * i + static_cast<std::size_t>(axis);
                if (!translations.empty()) trs.translation[axis] = double{translations[at]};
                if (!scales.empty()) trs.scale[axis] = double{scales[at]};
            }
            if (!rotations.empty()) {
                const float* r = rotations.data() + 4 * i;
                trs.rotation = glm::dquat(double{r[3]}, double{r[0]}, double{r[1]}, double{r[2]});
            }
            result[i] = trs.matrix();
        }
        return result;
    }

    /// Adds bytes to the total and checks the limit. The nodes of even a small file may need much
    /// memory.
    void takeBytes(std::uint64_t bytes, const std::string& where) {
        limit_.take(bytes, where);
        document_.memory.allow(bytes, where);
    }

    /// Returns the bytes of a node's own copy of the vertices; 0 unless joints or morph targets
    /// deform its mesh.
    std::uint64_t deformedBytes(const Node& node) const {
        if (node.mesh < 0) return 0;
        std::uint64_t bytes = 0;
        for (const Primitive& p : scene_.meshes[static_cast<std::size_t>(node.mesh)].primitives)
            if (node.skin >= 0 || !p.targets.empty())
                bytes += p.positions.size() * (2 * sizeof(glm::vec3) + sizeof(glm::vec4)) +
                         displacedBytes(p);
        return bytes;
    }

    Skin skin(const json& source, const std::string& where) {
        Skin skin;
        if (const auto name = source.find("name"); name != source.end() && name->is_string())
            skin.name = name->get<std::string>();
        skin.joints = source["joints"].get<std::vector<int>>();
        if (skin.joints.empty()) failGltf("a skin must have at least one joint", where + "/joints");
        document_.memory.allow(skin.joints.size() * (sizeof(glm::dmat4) + 16 * sizeof(float)),
                               where);
        skin.inverse_bind.assign(skin.joints.size(), glm::dmat4(1));
        const auto matrices = source.find("inverseBindMatrices");
        if (matrices == source.end()) return skin;
        const std::vector<float> values = accessors_.matrices(
            matrices->get<int>(), skin.joints.size(), where + "/inverseBindMatrices");
        for (std::size_t i = 0; i < skin.joints.size(); ++i)
            skin.inverse_bind[i] = matrixOf(values.data() + 16 * i);
        return skin;
    }

    void checkSkin(const Node& node, const std::string& where) {
        if (node.skin < 0) return;
        const auto mesh = static_cast<std::size_t>(node.mesh);
        if (mesh_joints_.empty()) {
            for (const Mesh& each : scene_.meshes)
                mesh_joints_.push_back(jointsOf(each));
        }
        const std::size_t joints = scene_.skins[static_cast<std::size_t>(node.skin)].joints.size();
        if (mesh_joints_[mesh] > joints)
            failGltf("mesh " + std::to_string(node.mesh) + " is moved by joint " +
                         std::to_string(mesh_joints_[mesh] - 1) + ", but the skin has " +
                         std::to_string(joints) + " joints",
                     where + "/skin");
    }

    void checkWeights(const Node& node, const std::string& where) {
        if (!node.weights || node.mesh < 0) return;
        const auto& primitives = scene_.meshes[static_cast<std::size_t>(node.mesh)].primitives;
        if (!primitives.empty() && node.weights->size() != primitives.front().targets.size())
            document_.warn("The number of weights of " + where +
                           " differs from the number of morph targets " + "of its mesh.");
    }

    GltfDocument& document_;
    Scene& scene_;
    AccessorReader accessors_;
    std::vector<std::size_t> mesh_joints_;  ///< for each mesh, the number of joints that it needs
    SizeLimit limit_;
};

}  // namespace

void readGltfNodes(GltfDocument& document, const GltfOptions& options, Scene& scene) {
    NodeReader(document, options, scene).read();
}

}  // namespace peeler
