// SPDX-License-Identifier: Apache-2.0
// Materials as the shaders see them: the record of uniforms, the features that choose a shader
// variant, and the mipmaps of their textures.
#pragma once

#include <cstdint>
#include <span>
#include <vector>

#include <peeler/material.h>
#include <peeler/scene.h>
#include "shaders/interface.glsl"

namespace peeler {

/// A material's numbers as its block of uniforms holds them; textures are bound apart.
shader::MaterialRecord materialRecord(const Material& material);

/// What a material may need beyond plain metallic-roughness: a definition of the shaders', and
/// whether the material needs it.
struct MaterialFeature {
    const char* definition;
    bool (*used)(const Material&);
    bool changes_alpha = false;  ///< so that it counts where light does not, too
};
/// All of them; a shader variant has a bit for each, in this order.
std::span<const MaterialFeature> materialFeatures();

/// Throws Error (kDevice) if the material has more textures than a shader of the device takes,
/// besides those of lights and methods.
void checkTextureUnits(Material material, int units);

/// Levels of a full chain for an image of this size, the image itself included.
int mipmapLevels(int width, int height);

/// The next smaller level: each size halved, rounded down, at least 1. Box filter; where a size is
/// odd, each texel averages the (up to three) texels it covers by their overlap. `srgb`: R, G and B
/// are averaged as linear values. Alpha is averaged as it is.
Image halved(const Image& image, bool srgb);

}  // namespace peeler
