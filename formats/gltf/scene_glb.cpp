// SPDX-License-Identifier: Apache-2.0
// Conversion of scenes of other formats to glTF.
#include <algorithm>
#include <cstring>

#include <peeler/error.h>
#include "formats/gltf/glb_writer.h"

namespace peeler {
namespace {

using nlohmann::ordered_json;

constexpr int kFloatComponent = 5126, kUnsignedIntComponent = 5125, kElementArrayBuffer = 34963;

template <class T>
std::vector<std::uint8_t> bytesOf(const std::vector<T>& values) {
    std::vector<std::uint8_t> bytes(values.size() * sizeof(T));
    if (!bytes.empty()) std::memcpy(bytes.data(), values.data(), bytes.size());
    return bytes;
}

template <class Vector>
ordered_json arrayOf(const Vector& v) {
    ordered_json array = ordered_json::array();
    for (int i = 0; i < v.length(); ++i)
        array.push_back(v[i]);
    return array;
}

/// Writes the matrix column-major, as glTF requires. Omits the identity.
void setMatrix(ordered_json& node, const glm::dmat4& matrix) {
    if (matrix == glm::dmat4(1)) return;
    ordered_json& array = node["matrix"] = ordered_json::array();
    for (int column = 0; column < 4; ++column)
        for (int row = 0; row < 4; ++row)
            array.push_back(matrix[column][row]);
}

/// Returns a material's JSON, without textures.
ordered_json materialJson(const Material& material) {
    constexpr const char* kAlphaModes[] = {"OPAQUE", "MASK", "BLEND"};
    ordered_json object;
    if (!material.name.empty()) object["name"] = material.name;
    object["pbrMetallicRoughness"] = {{"baseColorFactor", arrayOf(material.base_color)},
                                      {"metallicFactor", material.metallic},
                                      {"roughnessFactor", material.roughness}};
    object["emissiveFactor"] = arrayOf(glm::min(material.emissive, 1.0F));
    object["alphaMode"] = kAlphaModes[static_cast<std::size_t>(material.alpha_mode)];
    object["doubleSided"] = material.double_sided;
    ordered_json extensions = ordered_json::object();
    if (const float most =
            std::max({material.emissive.r, material.emissive.g, material.emissive.b});
        most > 1) {
        object["emissiveFactor"] = arrayOf(material.emissive / most);
        extensions["KHR_materials_emissive_strength"] = {{"emissiveStrength", most}};
    }
    if (material.sheen.color != glm::vec3(0))
        extensions["KHR_materials_sheen"] = {{"sheenColorFactor", arrayOf(material.sheen.color)}};
    if (material.clearcoat.factor > 0)
        extensions["KHR_materials_clearcoat"] = {
            {"clearcoatFactor", material.clearcoat.factor},
            {"clearcoatRoughnessFactor", material.clearcoat.roughness}};
    if (material.anisotropy.strength > 0)
        extensions["KHR_materials_anisotropy"] = {
            {"anisotropyStrength", material.anisotropy.strength},
            {"anisotropyRotation", material.anisotropy.rotation}};
    if (!extensions.empty()) object["extensions"] = std::move(extensions);
    return object;
}

ordered_json nodeJson(const Node& node) {
    ordered_json object = ordered_json::object();
    if (!node.name.empty()) object["name"] = node.name;
    if (!node.children.empty()) object["children"] = node.children;
    if (node.mesh >= 0) object["mesh"] = node.mesh;
    setMatrix(object, node.local);
    return object;
}

}  // namespace

GlbWriter::GlbWriter(const std::filesystem::path& path, const Scene& scene)
    : path_(path.string()), folder_(path, 0) {
    json_["asset"] = {{"version", "2.0"}, {"generator", "peeler " PEELER_VERSION}};
    json_["scene"] = scene.default_scene;
    for (const SceneRoots& roots : scene.scenes)
        json_["scenes"].push_back({{"nodes", roots.roots}});
    for (const Node& node : scene.nodes)
        json_["nodes"].push_back(nodeJson(node));
    std::vector<std::string> extensions;
    // The last material is glTF's default material, which files do not list.
    for (std::size_t i = 0; i + 1 < scene.materials.size(); ++i) {
        ordered_json material = materialJson(scene.materials[i]);
        if (const auto found = material.find("extensions"); found != material.end())
            for (const auto& [name, value] : found->items())
                if (std::ranges::find(extensions, name) == extensions.end())
                    extensions.push_back(name);
        json_["materials"].push_back(std::move(material));
    }
    if (!extensions.empty()) json_["extensionsUsed"] = extensions;
    if (!scene.images.empty())
        warnings_.emplace_back("The textures of the scene are not written to the .glb.");
    json_["buffers"] = ordered_json::array({ordered_json::object()});
    for (const Mesh& mesh : scene.meshes) {
        ordered_json primitives = ordered_json::array();
        for (const Primitive& primitive : mesh.primitives)
            primitives.push_back(primitiveJson(primitive, scene.materials.size()));
        json_["meshes"].push_back({{"name", mesh.name}, {"primitives", std::move(primitives)}});
    }
}

ordered_json GlbWriter::primitiveJson(const Primitive& primitive, std::size_t materials) {
    ordered_json attributes;
    const auto add = [&](const char* name, const char* type, const auto& values) {
        if (values.empty()) return;
        attributes[name] =
            addAccessor(bytesOf(values), {kFloatComponent, false, type, values.size()});
    };
    add("POSITION", "VEC3", primitive.positions);
    glm::vec3 least = primitive.positions.front(), most = least;
    for (const glm::vec3& p : primitive.positions) {
        least = glm::min(least, p);
        most = glm::max(most, p);
    }
    json_["accessors"].back()["min"] = arrayOf(least);
    json_["accessors"].back()["max"] = arrayOf(most);
    add("NORMAL", "VEC3", primitive.normals);
    add("TEXCOORD_0", "VEC2", primitive.texcoords[0]);
    add("COLOR_0", "VEC4", primitive.colors);
    ordered_json json = {{"attributes", std::move(attributes)},
                         {"mode", static_cast<int>(primitive.topology)}};
    if (!primitive.indices.empty()) {
        json["indices"] =
            addAccessor(bytesOf(primitive.indices),
                        {kUnsignedIntComponent, false, "SCALAR", primitive.indices.size()});
        json_["bufferViews"].back()["target"] = kElementArrayBuffer;
    }
    if (static_cast<std::size_t>(primitive.material) + 1 < materials)
        json["material"] = primitive.material;
    return json;
}

std::uint64_t GlbWriter::memory(const Scene& scene) {
    std::uint64_t bytes = 0;
    const auto add = [&](const auto& values) { bytes += values.size() * sizeof(values[0]); };
    for (const Mesh& mesh : scene.meshes) {
        for (const Primitive& primitive : mesh.primitives) {
            add(primitive.positions);
            add(primitive.normals);
            add(primitive.texcoords[0]);
            add(primitive.colors);
            add(primitive.indices);
        }
    }
    return bytes;
}

}  // namespace peeler
