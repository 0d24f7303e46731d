// SPDX-License-Identifier: Apache-2.0
// Writers of baked vertex attributes and occlusion textures into a glTF file.
#pragma once

#include <cstdint>
#include <glm/glm.hpp>
#include <span>
#include <string>
#include <vector>

#include <peeler/scene.h>
#include "formats/gltf/glb_writer.h"

namespace peeler {

/// The values baked for a primitive in the mesh of one node, per vertex of the Scene
/// (Primitive::source gives the file's vertices).
struct BakedPrimitive {
    int node = 0;
    PrimitiveSource source{};
    std::vector<glm::u16vec4> colors{};  ///< COLOR_0, normalised
    /// 1 or 3 values per vertex; the number is the same in all primitives.
    std::vector<float> values{};
    bool operator==(const BakedPrimitive& other) const {
        return source.primitive == other.source.primitive && colors == other.colors &&
               values == other.values;
    }
};

/// Adds to each primitive its COLOR_0, replacing any existing COLOR_0, and its values as
/// `attribute`, an application-specific name (glTF 2.0 §3.7.2.1: "_AO"). If nodes show the same
/// mesh with different values, each version of the mesh becomes a copy. The copies share all other
/// accessors. Nodes without values keep the original mesh.
///
/// In Draco-compressed primitives (KHR_draco_mesh_compression allows additional uncompressed
/// attributes), the new attributes follow the order of the decoded vertices, and a compressed
/// COLOR_0 is removed from the extension. Throws Error (kInput) if the values were baked for
/// another file.
void addVertexValues(GlbWriter& package, const std::string& attribute,
                     const std::vector<BakedPrimitive>& primitives);

/// Gives all primitives the same white, unlit material (KHR_materials_unlit), so that viewers show
/// COLOR_0 alone.
void showVertexColorsAlone(GlbWriter& package);

/// Sets the scene that viewers show by default.
void setDefaultScene(GlbWriter& package, int scene);

/// Sets every primitive's material to its material in a variant (KHR_materials_variants), so that
/// viewers without the extension also show the variant.
void setVariant(GlbWriter& package, std::size_t variant);

struct BakedTexture {
    int material = -1;  ///< index in the file; −1 for primitives without a material
    std::vector<std::uint8_t> png;
};

/// Sets occlusionTexture in these materials, replacing any existing one. Primitives without a
/// material get a copy of the default material with the texture. A texture needs its TEXCOORD_n
/// (glTF 2.0 §3.9.2), so primitives without this UV set keep their material unchanged. If only some
/// primitives of a material have the UV set, they get a copy of the material with the texture.
void addOcclusionTextures(GlbWriter& package, int uv_set, std::vector<BakedTexture> textures);

}  // namespace peeler
