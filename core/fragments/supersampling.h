// SPDX-License-Identifier: Apache-2.0
// Supersampling: merges sub-pixel samples into one picture.
#pragma once

#include <cstdint>
#include <functional>
#include <glm/glm.hpp>
#include <span>
#include <vector>

#include <peeler/composite.h>
#include <peeler/layered_image.h>

namespace peeler {

/// Returns the sample positions in a pixel (0–1, y down): the centre for one sample, else the
/// Hammersley set (van der Corput sequence against equal steps), which is evenly spread for any
/// number.
std::vector<glm::dvec2> samplePositions(int samples);

/// Initialises an empty mean for these pixels. `with_opacity`: with coloured opacity.
void beginMean(const Window& window, CompositeImage& mean, bool with_opacity = false);

/// Adds one sample's composite, or a part of it, to the mean of `samples` composites: averages
/// colours and keeps the nearest Z.
void addToMean(const CompositeImage& sample, int samples, CompositeImage& mean);

/// The name of the array of draw-order keys.
inline constexpr const char* kKeyChannel = "key";

/// A function that returns the surface (node and primitive of the mesh) that a primitive, given by
/// its key, belongs to.
using SurfaceOf = std::function<std::uint32_t(std::uint32_t primitive)>;

/// Merges the samples of one band into fragments with coverage. The first extra array of each image
/// holds the keys; the others are channels. Two fragments of different samples merge if they belong
/// to the same surface, if merging keeps the order within each sample, and if no other fragment of
/// that surface in the other sample is nearer in Z. Different surfaces never bleed into each other.
///
/// A merged fragment has the Z and channels of the nearest sample. Its alpha is the share it covers
/// of the area left uncovered by the fragments in front of it, sample by sample, so that
/// compositing the merged fragments gives the mean of the samples' composites: with T the remaining
/// transmittance of each sample, alpha = Σ T·a / Σ T, and the same for colour. Where T is 0 in
/// every sample, the plain mean is used. With coloured opacity each channel has its own T. (The
/// same reasoning makes deep images hold up at shared edges; cf. Egstad, Davis & Lacewell,
/// "Improved Deep Image Compositing Using Subpixel Masks", DigiPro 2015.)
void mergeSamples(std::span<const LayeredImage> samples, const SurfaceOf& surface_of,
                  PixelType color_type, LayeredImage& out);

}  // namespace peeler
