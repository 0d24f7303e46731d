// SPDX-License-Identifier: Apache-2.0
// Adds baked values to a glTF file: to vertices, or as occlusion textures.
#pragma once

#include <cstdint>
#include <glm/glm.hpp>
#include <span>
#include <string>
#include <vector>

#include <peeler/scene.h>
#include "formats/gltf/glb_writer.h"

namespace peeler {

/// What the vertices of a primitive get, where one node shows it. The vertices are those that the
/// Scene has of it (Primitive::source).
struct BakedPrimitive {
    int node = 0;
    PrimitiveSource source{};
    std::vector<glm::u16vec4> colors{};  ///< COLOR_0, normalised
    std::vector<float> values{};         ///< for each vertex as many as all others have, 1 or 3
    bool operator==(const BakedPrimitive& other) const {
        return source.primitive == other.source.primitive && colors == other.colors &&
               values == other.values;
    }
};

/// Adds COLOR_0 in place of what was there, and the values as `attribute`, an application-specific
/// name (glTF 2.0 §3.7.2.1: "_AO"). Nodes that show a mesh with different values get a copy of it
/// that shares all other accessors; nodes without values keep the mesh as it was. In
/// Draco-compressed primitives (KHR_draco_mesh_compression allows attributes beside the compressed
/// ones) the new ones stand in the order of the decoded vertices, and a compressed COLOR_0 is no
/// longer named. Throws Error (kInput) if the file is not the one that the values were made for.
void addVertexValues(GlbWriter& package, const std::string& attribute,
                     const std::vector<BakedPrimitive>& primitives);

/// Gives everything one material, white and unlit (KHR_materials_unlit), so that viewers show
/// COLOR_0 and nothing else.
void showVertexColorsAlone(GlbWriter& package);

/// Makes one of the file's scenes the default one, which viewers show.
void setDefaultScene(GlbWriter& package, int scene);

/// Gives every primitive its material of a variant (KHR_materials_variants), so that those who do
/// not know the extension show it, too.
void setVariant(GlbWriter& package, std::size_t variant);

struct BakedTexture {
    int material = -1;  ///< of the file; −1 = of primitives that name none
    std::vector<std::uint8_t> png;
};

/// Sets the materials' occlusionTexture, in place of what was there. Primitives without a material
/// get one that differs from the default in this only. Primitives without that UV set keep their
/// materials as they were (glTF 2.0 §3.9.2: a texture needs its TEXCOORD_n): of a material that
/// some have and others lack the UVs for, the others get a copy with the texture.
void addOcclusionTextures(GlbWriter& package, int uv_set, std::vector<BakedTexture> textures);

}  // namespace peeler
