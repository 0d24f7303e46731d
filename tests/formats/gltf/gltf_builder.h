// SPDX-License-Identifier: Apache-2.0
// A builder of small glTF files for tests: JSON, and a buffer to which accessors are appended.
#pragma once

#include <gtest/gtest.h>

#include <cstdint>
#include <cstring>
#include <filesystem>
#include <fstream>
#include <nlohmann/json.hpp>
#include <optional>
#include <string>
#include <type_traits>
#include <vector>

#include <peeler/error.h>
#include "formats/gltf/gltf_reader.h"
#include "support/test_support.h"

namespace peeler::test {

template <typename T>
constexpr int componentType() {
    if constexpr (std::is_same_v<T, std::int8_t>) return 5120;
    if constexpr (std::is_same_v<T, std::uint8_t>) return 5121;
    if constexpr (std::is_same_v<T, std::int16_t>) return 5122;
    if constexpr (std::is_same_v<T, std::uint16_t>) return 5123;
    if constexpr (std::is_same_v<T, std::uint32_t>) return 5125;
    return 5126;
}

template <typename T>
Bytes toBytes(const std::vector<T>& values) {
    Bytes bytes(values.size() * sizeof(T));
    if (!bytes.empty()) std::memcpy(bytes.data(), values.data(), bytes.size());
    return bytes;
}

inline void writeFile(const std::filesystem::path& path, const std::string& text) {
    std::ofstream(path, std::ios::binary)
        .write(text.data(), static_cast<std::streamsize>(text.size()));
}
inline void writeFile(const std::filesystem::path& path, const Bytes& bytes) {
    writeFile(path, std::string(bytes.begin(), bytes.end()));
}

/// Returns a .glb of this JSON and BIN chunk, both padded to 4 bytes.
inline std::string glb(std::string text, Bytes bin) {
    const auto number = [](std::size_t value) {
        std::string bytes(4, '\0');
        for (std::size_t i = 0; i < 4; ++i)
            bytes[i] = static_cast<char>(value >> (8 * i) & 0xFF);
        return bytes;
    };
    while (text.size() % 4)
        text += ' ';
    while (bin.size() % 4)
        bin.push_back(0);
    std::string chunks = number(text.size()) + "JSON" + text;
    if (!bin.empty())
        chunks +=
            number(bin.size()) + std::string("BIN\0", 4) + std::string(bin.begin(), bin.end());
    return "glTF" + number(2) + number(12 + chunks.size()) + chunks;
}

struct GltfBuilder {
    Json gltf = {{"asset", {{"version", "2.0"}}}};
    Bytes bin;

    /// Appends bytes as a buffer view, 4-byte aligned, and returns its index. `more` adds members
    /// such as byteStride.
    int addView(const Bytes& bytes, const Json& more = Json::object()) {
        while (bin.size() % 4)
            bin.push_back(0);
        Json view = {{"buffer", 0}, {"byteOffset", bin.size()}, {"byteLength", bytes.size()}};
        view.update(more);
        bin.insert(bin.end(), bytes.begin(), bytes.end());
        gltf["bufferViews"].push_back(view);
        return static_cast<int>(gltf["bufferViews"].size()) - 1;
    }

    int addAccessor(const Json& accessor) {
        gltf["accessors"].push_back(accessor);
        return static_cast<int>(gltf["accessors"].size()) - 1;
    }

    /// Adds an accessor of tightly packed values of type "SCALAR", "VEC2", …
    template <typename T>
    int addAccessor(const std::vector<T>& values, const std::string& type,
                    const Json& more = Json::object()) {
        const std::size_t width = type == "SCALAR" ? 1 : static_cast<std::size_t>(type[3] - '0');
        Json accessor = {{"bufferView", addView(toBytes(values))},
                         {"componentType", componentType<T>()},
                         {"count", values.size() / width},
                         {"type", type}};
        accessor.update(more);
        return addAccessor(accessor);
    }

    Json& primitive() { return gltf["meshes"][0]["primitives"][0]; }
    Json& attributes() { return primitive()["attributes"]; }

    /// Writes NAME (.gltf with NAME.bin beside it, or .glb) and returns its path.
    std::filesystem::path write(const ScratchDir& folder, const std::string& name = "scene.gltf") {
        Json out = gltf;
        const std::filesystem::path path = folder / name;
        if (!bin.empty() && !out.contains("buffers"))
            out["buffers"] = {{{"byteLength", bin.size()}}};
        if (path.extension() == ".glb") {
            writeFile(path, glb(out.dump(), bin));
            return path;
        }
        if (!bin.empty() && !out["buffers"][0].contains("uri")) {
            out["buffers"][0]["uri"] = "scene.bin";
            writeFile(folder / "scene.bin", bin);
        }
        writeFile(path, out.dump());
        return path;
    }
};

/// Returns one triangle (0,0,0) (1,0,0) (0,1,0) at one node of one scene.
inline GltfBuilder triangle() {
    GltfBuilder builder;
    const int position = builder.addAccessor<float>({0, 0, 0, 1, 0, 0, 0, 1, 0}, "VEC3");
    builder.gltf["meshes"] = {{{"primitives", {{{"attributes", {{"POSITION", position}}}}}}}};
    builder.gltf["nodes"] = {{{"mesh", 0}}};
    builder.gltf["scenes"] = {{{"nodes", {0}}}};
    builder.gltf["scene"] = 0;
    return builder;
}

inline Scene load(GltfBuilder builder, const GltfOptions& options = {}) {
    const ScratchDir folder;
    return readGltf(builder.write(folder), options);
}

/// Returns the error from reading the file. The test fails if reading succeeds.
inline Error errorOf(const std::filesystem::path& path, const GltfOptions& options = {}) {
    try {
        readGltf(path, options);
    } catch (const Error& error) {
        return error;
    }
    ADD_FAILURE() << path << " was read without an error";
    return Error(ErrorKind::kInternal, "none");
}
inline Error errorOf(GltfBuilder builder, const GltfOptions& options = {}) {
    const ScratchDir folder;
    return errorOf(builder.write(folder), options);
}

/// A fault in a file's JSON, and the expected location of the error.
struct Damage {
    const char *name, *json, *where;
};

/// A wrong claim in a file about its data. `where` is the expected location of the error, and
/// `words` is a part of the error's text.
struct Lie {
    const char* name;
    void (*tell)(GltfBuilder&);
    const char *where, *words;
};

/// Whether a warning of the scene contains these words.
inline bool warned(const Scene& scene, const std::string& words) {
    for (const Text& warning : scene.warnings)
        if (contains(warning, words)) return true;
    return false;
}

}  // namespace peeler::test
