// SPDX-License-Identifier: Apache-2.0
// Small glTF files for tests of materials.
#pragma once

#include <string>

#include "formats/gltf/gltf_builder.h"
#include "formats/image/png_builder.h"

namespace peeler::test {

inline Bytes onePixelPng(std::uint8_t r, std::uint8_t g, std::uint8_t b) {
    return png(1, 1, PngColor::kRgb, 8, {r, g, b});
}

/// Returns a triangle with this material, both sets of texture coordinates, and `images` textures.
/// The i-th texture has a single pixel (i, 0, 0).
inline GltfBuilder withMaterial(const std::string& material, int images = 0) {
    GltfBuilder builder = triangle();
    builder.gltf["materials"] = {Json::parse(material)};
    builder.primitive()["material"] = 0;
    const int texcoords = builder.addAccessor<float>({0, 0, 1, 0, 0, 1}, "VEC2");
    builder.attributes()["TEXCOORD_0"] = builder.attributes()["TEXCOORD_1"] = texcoords;
    for (int i = 0; i < images; ++i) {
        const Bytes pixel = onePixelPng(static_cast<std::uint8_t>(i), 0, 0);
        builder.gltf["images"].push_back(
            {{"bufferView", builder.addView(pixel)}, {"mimeType", "image/png"}});
        builder.gltf["textures"].push_back({{"source", i}});
    }
    return builder;
}

}  // namespace peeler::test
