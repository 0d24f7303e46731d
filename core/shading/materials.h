// SPDX-License-Identifier: Apache-2.0
// Materials for the shaders: uniform records, the features that select a shader variant, and
// texture mipmaps.
#pragma once

#include <cstdint>
#include <span>
#include <vector>

#include <peeler/material.h>
#include <peeler/scene.h>
#include "shaders/interface.glsl"

namespace peeler {

/// Returns a material's uniform block; textures are bound separately.
shader::MaterialRecord materialRecord(const Material& material);

/// A material feature beyond plain metallic-roughness, with the macro that shaders test for it.
struct MaterialFeature {
    const char* definition;
    bool (*used)(const Material&);
    bool changes_alpha = false;  ///< also matters for passes without lighting
};
/// Returns all features; a shader variant has one bit for each, in this order.
std::span<const MaterialFeature> materialFeatures();

/// Throws Error (kDevice) if the material has more textures than the device's texture units allow,
/// besides those of lights and methods.
void checkTextureUnits(Material material, int units);

/// Returns the number of levels in a full mipmap chain, including the image itself.
int mipmapLevels(int width, int height);

/// Returns the next smaller mipmap level: each size halved, rounded down, at least 1. Box filter;
/// at an odd size, each texel averages the (up to three) texels it covers by their overlap. `srgb`:
/// R, G and B are averaged as linear values. Alpha is averaged as stored.
Image halved(const Image& image, bool srgb);

}  // namespace peeler
