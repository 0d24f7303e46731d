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

/// Returns a material's uniform block. Textures are bound separately.
shader::MaterialRecord materialRecord(const Material& material);

/// A material feature beyond plain metallic-roughness, with the macro that shaders test.
struct MaterialFeature {
    const char* definition;
    bool (*used)(const Material&);
    /// Whether the feature changes alpha, so that passes without lighting also need it.
    bool changes_alpha = false;
};
/// Returns all features. A shader variant has one bit for each, in this order.
std::span<const MaterialFeature> materialFeatures();

/// Throws Error (kDevice) if the material's textures, with those of lights and methods, exceed the
/// device's texture units.
void checkTextureUnits(Material material, int units);

/// Returns the number of levels in a full mipmap chain, including the original image.
int mipmapLevels(int width, int height);

/// Returns the next smaller mipmap level. Each side is halved, rounded down, but at least 1. Uses a
/// box filter: if the size is odd, each texel averages up to three source texels, weighted by
/// overlap. `srgb`: R, G and B are averaged as linear values. Alpha is averaged as stored.
Image halved(const Image& image, bool srgb);

}  // namespace peeler
