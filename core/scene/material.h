// SPDX-License-Identifier: Apache-2.0
// Properties derived from a material: textures, reflectance, transmission.
#pragma once

#include <array>
#include <cstddef>

#include <peeler/material.h>

namespace peeler {

/// A texture slot of a material.
struct MaterialTexture {
    TextureRef* ref = nullptr;  ///< null if the material has no such member
    bool srgb = false;
};
inline constexpr std::size_t kMaterialTextures = 17;

/// Returns all texture slots, in the order of the texture units (PEELER_BASE_COLOR_UNIT …).
std::array<MaterialTexture, kMaterialTextures> texturesOf(Material& material);

/// Returns the reflectance of a dielectric in air at normal incidence. An ior of 0 means infinity
/// (KHR_materials_ior), which gives 1.
float dielectricF0(float ior);

/// Whether light passes through the surface, which then occludes nothing.
bool isTransmissive(const Material& material);

/// Whether the material hides what is behind it: OPAQUE or MASK, not transmissive.
inline bool isOpaque(const Material& material) {
    return material.alpha_mode != AlphaMode::kBlend && !isTransmissive(material);
}

/// Whether the material may tint transmitted light because its base colour, texture or volume may
/// filter channels differently. Ignores vertex colours.
bool isTintedGlass(const Material& material);

}  // namespace peeler
