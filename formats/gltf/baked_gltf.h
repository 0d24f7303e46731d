// SPDX-License-Identifier: Apache-2.0
// Baked vertex attributes and occlusion textures in a glTF file.
#pragma once

#include <cstdint>
#include <glm/glm.hpp>
#include <span>
#include <string>
#include <vector>

#include <peeler/scene.h>
#include "formats/gltf/glb_writer.h"

namespace peeler {

/// Baked values of a primitive as shown by one node, for the vertices that the Scene has
/// (Primitive::source).
struct BakedPrimitive {
    int node = 0;
    PrimitiveSource source{};
    std::vector<glm::u16vec4> colors{};  ///< COLOR_0, normalised
    std::vector<float> values{};         ///< same number per vertex in all primitives, 1 or 3
    bool operator==(const BakedPrimitive& other) const {
        return source.primitive == other.source.primitive && colors == other.colors &&
               values == other.values;
    }
};

/// Writes COLOR_0, replacing any existing one, and the values as `attribute`, an
/// application-specific name (glTF 2.0 §3.7.2.1: "_AO"). Nodes that show a mesh with different
/// values get their own copy of it, which shares all other accessors; nodes without values keep the
/// original mesh. In Draco-compressed primitives (KHR_draco_mesh_compression allows additional
/// uncompressed attributes) the new attributes follow the order of the decoded vertices, and a
/// compressed COLOR_0 is dropped from the extension. Throws Error (kInput) if the file is not the
/// one the values were baked for.
void addVertexValues(GlbWriter& package, const std::string& attribute,
                     const std::vector<BakedPrimitive>& primitives);

/// Gives every primitive one white, unlit material (KHR_materials_unlit), so that viewers show
/// COLOR_0 alone.
void showVertexColorsAlone(GlbWriter& package);

/// Sets the default scene, the one viewers show.
void setDefaultScene(GlbWriter& package, int scene);

/// Assigns every primitive its material from a variant (KHR_materials_variants), so that viewers
/// without the extension show the variant too.
void setVariant(GlbWriter& package, std::size_t variant);

struct BakedTexture {
    int material = -1;  ///< index in the file; −1 = primitives without a material
    std::vector<std::uint8_t> png;
};

/// Sets the materials' occlusionTexture, replacing any existing one. Primitives without a material
/// get a copy of the default material with the texture. Primitives without this UV set keep their
/// materials (glTF 2.0 §3.9.2: a texture needs its TEXCOORD_n): where only some primitives of a
/// material have the UV set, those get a copy of it with the texture.
void addOcclusionTextures(GlbWriter& package, int uv_set, std::vector<BakedTexture> textures);

}  // namespace peeler
