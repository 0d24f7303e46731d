// SPDX-License-Identifier: Apache-2.0
// Mipmap levels of 8-bit textures, made on the CPU: the same on every driver, and sooner done than
// a software renderer compiles its own.
#pragma once

#include <cstdint>
#include <vector>

#include "core/scene/scene.h"

namespace peeler {

/// Levels of a full chain for an image of this size, the image itself included.
int mipmapLevels(int width, int height);

/// The next smaller level: each size halved, rounded down, at least 1. Box filter; where a size is
/// odd, each texel averages the (up to three) texels it covers by their overlap. `srgb`: R, G and B
/// are averaged as linear values. Alpha is averaged as it is.
Image halved(const Image& image, bool srgb);

}  // namespace peeler
