// SPDX-License-Identifier: Apache-2.0
// A small glTF file with meshopt-compressed buffer views.
#pragma once

#include <string>
#include <vector>

#include "formats/gltf/gltf_builder.h"
#include "formats/gltf/meshopt_stream.h"

namespace peeler::test {

inline const std::vector<float> kTriangleCorners = {0, 0, 0, 0, 1, 0,
                                                    0, 0, 0, 1, 0, 0};  // 16 bytes per corner

/// Returns the triangle with compressed corners and indices in buffer views 0 and 1. Both views are
/// in buffer 1, which has no URI.
inline GltfBuilder compressed(const std::string& name = "EXT_meshopt_compression") {
    GltfBuilder builder;
    const Bytes corners = encodeAttributes(kTriangleCorners.data(), 3, 16);
    const Bytes indices = encodeTriangles({0, 1, 2});
    const auto add = [&](const Bytes& bytes, std::size_t offset, const Json& more) {
        const std::size_t begin = builder.bin.size();
        builder.bin.insert(builder.bin.end(), bytes.begin(), bytes.end());
        Json extension = {{"buffer", 0}, {"byteOffset", begin}, {"byteLength", bytes.size()}};
        extension.update(more);
        const std::size_t stride = more["byteStride"], count = more["count"];
        builder.gltf["bufferViews"].push_back({{"buffer", 1},
                                               {"byteOffset", offset},
                                               {"byteLength", stride * count},
                                               {"extensions", {{name, extension}}}});
    };
    add(corners, 0, {{"mode", "ATTRIBUTES"}, {"byteStride", 16}, {"count", 3}});
    add(indices, 48, {{"mode", "TRIANGLES"}, {"byteStride", 2}, {"count", 3}});
    builder.gltf["bufferViews"][0]["byteStride"] = 16;
    builder.gltf["buffers"] = {{{"byteLength", builder.bin.size()}}, {{"byteLength", 54}}};
    builder.gltf["accessors"] = {
        {{"bufferView", 0}, {"componentType", 5126}, {"count", 3}, {"type", "VEC3"}},
        {{"bufferView", 1}, {"componentType", 5123}, {"count", 3}, {"type", "SCALAR"}}};
    builder.gltf["meshes"] = {
        {{"primitives", {{{"attributes", {{"POSITION", 0}}}, {"indices", 1}}}}}};
    builder.gltf["nodes"] = {{{"mesh", 0}}};
    builder.gltf["scenes"] = {{{"nodes", {0}}}};
    builder.gltf["extensionsUsed"] = {name};
    return builder;
}

}  // namespace peeler::test
