// SPDX-License-Identifier: Apache-2.0
// What follows from a material: its textures, its reflectance, what passes through it.
#pragma once

#include <array>
#include <cstddef>

#include <peeler/material.h>

namespace peeler {

/// One of the textures that a material may use.
struct MaterialTexture {
    TextureRef* ref = nullptr;  ///< null: the material has no such member
    bool srgb = false;
};
inline constexpr std::size_t kMaterialTextures = 17;

/// All of them, in the order of the texture units (PEELER_BASE_COLOR_UNIT …).
std::array<MaterialTexture, kMaterialTextures> texturesOf(Material& material);

/// Reflectance at normal incidence of a dielectric in air; 1 for an ior of 0, which stands for
/// infinity (KHR_materials_ior).
float dielectricF0(float ior);

/// Whether light passes through the surface, so that it hides nothing.
bool isTransmissive(const Material& material);

/// Whether that light may come out coloured, whatever the vertices' colours are: base colour, its
/// texture, or the volume may tint one channel otherwise than another.
bool isTintedGlass(const Material& material);

}  // namespace peeler
