// SPDX-License-Identifier: Apache-2.0
// Several sub-pixel samples of a picture become one picture.
#pragma once

#include <cstdint>
#include <functional>
#include <glm/glm.hpp>
#include <span>
#include <vector>

#include <peeler/composite.h>
#include <peeler/layered_image.h>

namespace peeler {

/// Where in a pixel (0–1, y down) its samples lie: the centre for one, else the Hammersley set (van
/// der Corput's sequence against equal steps), which is evenly spread for any number.
std::vector<glm::dvec2> samplePositions(int samples);

/// The mean of no samples yet, of these pixels; `with_opacity`: with coloured opacity.
void beginMean(const Window& window, CompositeImage& mean, bool with_opacity = false);

/// Adds one sample's composite, or a part of it, to the mean of `samples` of them: colours are
/// averaged, Z is the nearest.
void addToMean(const CompositeImage& sample, int samples, CompositeImage& mean);

/// The name of the array of draw-order keys.
inline constexpr const char* kKeyChannel = "key";

/// Which surface (node and primitive of the mesh) a primitive belongs to.
using SurfaceOf = std::function<std::uint32_t(std::uint32_t primitive)>;

/// Merges samples of one band into fragments with coverage. The first extra array of each image is
/// that of the keys; the others are channels. Fragments of different samples merge if they belong
/// to one surface, keep the order of their samples, and none of the other sample's fragments of
/// that surface is nearer; different surfaces never bleed into each other.
///
/// Z and channels of a merged fragment are the nearest sample's. Its alpha is the share that it
/// covers of what the fragments in front of it leave uncovered, sample by sample, so that
/// compositing the merged fragments gives the mean of the samples' composites: with T the light
/// that still gets through each sample, alpha = Σ T·a / Σ T, likewise colour. Where nothing gets
/// through it is the plain mean. With coloured opacity each channel has its own T. (The same
/// reasoning that makes deep images hold up at shared edges; cf. Egstad, Davis & Lacewell,
/// "Improved Deep Image Compositing Using Subpixel Masks", DigiPro 2015.)
void mergeSamples(std::span<const LayeredImage> samples, const SurfaceOf& surface_of,
                  PixelType color_type, LayeredImage& out);

}  // namespace peeler
