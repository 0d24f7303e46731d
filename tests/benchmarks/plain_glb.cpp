// SPDX-License-Identifier: Apache-2.0
// Converts a scene of triangles to a plain .glb without textures, for programs that cannot read
// compressed meshes. Keeps positions, normals, indices, and each material's colour, roughness and
// mode.
//
//     plain_glb SCENE OUT.glb
#include <cstdint>
#include <cstdio>
#include <fstream>
#include <nlohmann/json.hpp>
#include <span>

#include <peeler/error.h>
#include "core/scene/posed_scene.h"
#include "formats/gltf/gltf_reader.h"

namespace peeler::benchmark {
namespace {

using nlohmann::json;

class PlainGlb {
  public:
    explicit PlainGlb(const Scene& scene) {
        for (const Material& material : scene.materials)
            addMaterial(material);
        for (const Mesh& mesh : scene.meshes)
            addMesh(mesh);
        const PosedScene shown(scene);
        for (const MeshInstance& instance : shown.meshes()) {
            json matrix = json::array();
            for (int i = 0; i < 16; ++i)
                matrix.push_back(instance.world[i / 4][i % 4]);
            document_["scenes"][0]["nodes"].push_back(document_["nodes"].size());
            document_["nodes"].push_back({{"mesh", instance.mesh}, {"matrix", matrix}});
        }
    }

    void write(const std::string& path) {
        document_["buffers"] = {{{"byteLength", binary_.size()}}};
        std::string text = document_.dump();
        text.append((4 - text.size() % 4) % 4, ' ');
        std::ofstream file(path, std::ios::binary);
        const auto put = [&](std::initializer_list<std::size_t> words) {
            for (const std::size_t word : words) {
                const auto narrow = static_cast<std::uint32_t>(word);
                file.write(reinterpret_cast<const char*>(&narrow), sizeof(narrow));
            }
        };
        put({0x46546C67, 2, 28 + text.size() + binary_.size(), text.size(), 0x4E4F534A});
        file << text;
        put({binary_.size(), 0x004E4942});
        file << binary_;
        if (!file.flush()) throw Error(ErrorKind::kOutput, "cannot be written", path);
    }

  private:
    void addMaterial(const Material& material) {
        if (material.base_color_texture || material.normal_texture)
            throw Error(ErrorKind::kInput, "has textures", material.name);
        constexpr const char* kModes[] = {"OPAQUE", "MASK", "BLEND"};
        const glm::vec4& color = material.base_color;
        document_["materials"].push_back(
            {{"pbrMetallicRoughness",
              {{"baseColorFactor", {color.r, color.g, color.b, color.a}},
               {"metallicFactor", material.metallic},
               {"roughnessFactor", material.roughness}}},
             {"alphaMode", kModes[static_cast<std::size_t>(material.alpha_mode)]},
             {"doubleSided", material.double_sided}});
    }

    template <class T>
    std::size_t accessor(const std::vector<T>& values, const char* type, int component) {
        const std::span bytes(reinterpret_cast<const char*>(values.data()),
                              values.size() * sizeof(T));
        document_["bufferViews"].push_back(
            {{"buffer", 0}, {"byteOffset", binary_.size()}, {"byteLength", bytes.size()}});
        binary_.append(bytes.begin(), bytes.end());
        document_["accessors"].push_back({{"bufferView", document_["bufferViews"].size() - 1},
                                          {"componentType", component},
                                          {"count", values.size()},
                                          {"type", type}});
        return document_["accessors"].size() - 1;
    }

    void addMesh(const Mesh& mesh) {
        constexpr int kFloat = 5126, kUnsigned = 5125;
        json primitives = json::array();
        for (const Primitive& p : mesh.primitives) {
            const std::size_t positions = accessor(p.positions, "VEC3", kFloat);
            glm::vec3 low = p.positions.at(0), high = low;
            for (const glm::vec3& position : p.positions) {
                low = glm::min(low, position);
                high = glm::max(high, position);
            }
            document_["accessors"][positions]["min"] = {low.x, low.y, low.z};
            document_["accessors"][positions]["max"] = {high.x, high.y, high.z};
            json primitive = {{"attributes", {{"POSITION", positions}}},
                              {"material", p.material},
                              {"mode", static_cast<int>(p.topology)}};
            if (!p.normals.empty())
                primitive["attributes"]["NORMAL"] = accessor(p.normals, "VEC3", kFloat);
            if (!p.indices.empty()) primitive["indices"] = accessor(p.indices, "SCALAR", kUnsigned);
            primitives.push_back(primitive);
        }
        document_["meshes"].push_back({{"primitives", primitives}});
    }

    json document_ = {{"asset", {{"version", "2.0"}}},
                      {"scene", 0},
                      {"scenes", {{{"nodes", json::array()}}}},
                      {"nodes", json::array()}};
    std::string binary_;
};

}  // namespace
}  // namespace peeler::benchmark

int main(int count, char** arguments) {
    if (count != 3) {
        std::fprintf(stderr, "usage: plain_glb SCENE OUT.glb\n");
        return 2;
    }
    try {
        peeler::benchmark::PlainGlb(peeler::readGltf(arguments[1])).write(arguments[2]);
        return 0;
    } catch (const std::exception& error) {
        std::fprintf(stderr, "plain_glb: %s\n", error.what());
        return 2;
    }
}
