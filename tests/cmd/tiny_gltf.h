// SPDX-License-Identifier: Apache-2.0
// Short glTF scenes, for tests that change or damage them.
#pragma once

#include <cstddef>
#include <cstdint>
#include <cstring>
#include <filesystem>
#include <fstream>
#include <nlohmann/json.hpp>
#include <string>

namespace peeler::test {

/// Returns a red, half-transparent, double-sided triangle in the plane z = 0. Its corners are in
/// "triangle.bin".
inline nlohmann::json triangleScene() {
    return nlohmann::json::parse(R"({
        "asset": {"version": "2.0"},
        "scene": 0,
        "scenes": [{"nodes": [0]}],
        "nodes": [{"mesh": 0, "name": "first"}],
        "meshes": [{"primitives": [{"attributes": {"POSITION": 0}, "indices": 1, "material": 0}]}],
        "materials": [{"alphaMode": "BLEND", "doubleSided": true,
                       "pbrMetallicRoughness": {"baseColorFactor": [1, 0, 0, 0.5]}}],
        "accessors": [
            {"bufferView": 0, "componentType": 5126, "count": 3, "type": "VEC3",
             "min": [-1, -1, 0], "max": [1, 1, 0]},
            {"bufferView": 1, "componentType": 5125, "count": 3, "type": "SCALAR"}],
        "bufferViews": [{"buffer": 0, "byteLength": 36},
                        {"buffer": 0, "byteOffset": 36, "byteLength": 12}],
        "buffers": [{"uri": "triangle.bin", "byteLength": 48}]
    })");
}

/// Returns the triangle's corners and these indices, which may be invalid.
inline std::string triangleBuffer(const std::array<std::uint32_t, 3>& indices = {0, 1, 2}) {
    const float corners[9] = {-1, -1, 0, 1, -1, 0, 0, 1, 0};
    std::string bytes(48, '\0');
    std::memcpy(bytes.data(), corners, 36);
    std::memcpy(bytes.data() + 36, indices.data(), 12);
    return bytes;
}

/// Returns `count` triangles one behind the other. Each fills the frame of the camera "front",
/// which is at a distance of 3 from the first.
inline nlohmann::json stackScene(int count) {
    nlohmann::json scene = triangleScene();
    scene["nodes"].clear();
    scene["scenes"][0]["nodes"].clear();
    for (int i = 0; i < count; ++i) {
        scene["nodes"].push_back(
            {{"mesh", 0}, {"translation", {0, 0, -0.1 * i}}, {"scale", {100, 100, 1}}});
        scene["scenes"][0]["nodes"].push_back(i);
    }
    scene["nodes"].push_back({{"camera", 0}, {"translation", {0, 0, 3}}});
    scene["scenes"][0]["nodes"].push_back(count);
    scene["cameras"] = nlohmann::json::parse(
        R"([{"type": "perspective", "name": "front", "perspective": {"yfov": 0.8, "znear": 0.1}}])");
    return scene;
}

/// Returns a red, a green and a blue pane of glass without reflections in front of a white, unlit
/// wall. The green and blue panes are narrow, so that pixels show one, two or all panes. The wall
/// is narrower than the picture.
inline nlohmann::json tintedPanes() {
    nlohmann::json scene = stackScene(4);
    const nlohmann::json primitive = scene["meshes"][0]["primitives"][0];
    const float colors[4][3] = {{1, 0.25F, 0.5F}, {0.25F, 1, 0.5F}, {0.5F, 0.5F, 1}, {1, 1, 1}};
    scene["materials"].clear();
    scene["meshes"].clear();
    for (std::size_t i = 0; i < 4; ++i) {
        scene["meshes"].push_back({{"primitives", {primitive}}});
        scene["meshes"][i]["primitives"][0]["material"] = i;
        scene["nodes"][i]["mesh"] = i;
        scene["nodes"][i]["name"] = "pane " + std::to_string(i);
        nlohmann::json material = nlohmann::json::parse(
            i < 3 ? R"({"doubleSided": true, "extensions": {
                        "KHR_materials_transmission": {"transmissionFactor": 1},
                        "KHR_materials_specular": {"specularFactor": 0}}})"
                  : R"({"doubleSided": true, "extensions": {"KHR_materials_unlit": {}}})");
        material["name"] = "glass " + std::to_string(i);
        material["pbrMetallicRoughness"] = {
            {"baseColorFactor", {colors[i][0], colors[i][1], colors[i][2], 1}},
            {"metallicFactor", 0}};
        scene["materials"].push_back(material);
    }
    scene["nodes"][1]["scale"] = {1, 1, 1};
    scene["nodes"][2]["scale"] = {0.5, 0.5, 1};
    scene["nodes"][3]["scale"] = {1.5, 1.5, 1};
    scene["extensionsUsed"] = {"KHR_materials_transmission", "KHR_materials_specular",
                               "KHR_materials_unlit"};
    return scene;
}

inline void writeText(const std::filesystem::path& path, const std::string& text) {
    std::ofstream file(path, std::ios::binary);
    file << text;
}

/// Writes "scene.gltf" and "triangle.bin". Returns the path of "scene.gltf".
inline std::filesystem::path writeScene(const std::filesystem::path& folder,
                                        const nlohmann::json& scene = triangleScene(),
                                        const std::string& buffer = triangleBuffer()) {
    writeText(folder / "triangle.bin", buffer);
    writeText(folder / "scene.gltf", scene.dump());
    return folder / "scene.gltf";
}

/// Returns the scene as a single GLB (glTF 2.0 §4.4).
inline std::string glb(nlohmann::json scene, const std::string& buffer = triangleBuffer()) {
    scene["buffers"][0].erase("uri");
    std::string json = scene.dump();
    while (json.size() % 4 != 0)
        json += ' ';
    const auto word = [](std::size_t value) {
        const auto v = static_cast<std::uint32_t>(value);
        return std::string(reinterpret_cast<const char*>(&v), 4);
    };
    const std::string chunks =
        word(json.size()) + "JSON" + json + word(buffer.size()) + std::string("BIN\0", 4) + buffer;
    return "glTF" + word(2) + word(12 + chunks.size()) + chunks;
}

}  // namespace peeler::test
