// SPDX-License-Identifier: Apache-2.0
// Supersampling: merging of sub-pixel samples into one picture.
#pragma once

#include <cstdint>
#include <functional>
#include <glm/glm.hpp>
#include <span>
#include <vector>

#include <peeler/composite.h>
#include <peeler/layered_image.h>

namespace peeler {

/// Returns the sample positions in a pixel (0–1, y down). A single sample is at the centre. Several
/// form a Hammersley set (van der Corput sequence against equal steps), which is evenly spread for
/// any number of samples; four are the usual positions of multisampling.
std::vector<glm::dvec2> samplePositions(int samples);

/// Initialises an empty mean for these pixels. `with_opacity`: whether opacity is coloured.
void beginMean(const Window& window, CompositeImage& mean, bool with_opacity = false);

/// Adds one sample's composite, or a part of it, to the mean of `samples` composites. Averages
/// colours and keeps the nearest Z.
void addToMean(const CompositeImage& sample, int samples, CompositeImage& mean);

/// The name of the array of draw-order keys.
inline constexpr const char* kKeyChannel = "key";

/// A function that returns the surface of the drawn primitive with this key. A surface is a
/// primitive of a mesh at a node.
using SurfaceOf = std::function<std::uint32_t(std::uint32_t key)>;

/// Merges the samples of one band into fragments with coverage. The first extra array of each image
/// holds the keys; the other extra arrays are channels. A fragment merges with fragments of other
/// samples if all belong to the same surface, if merging keeps the order within each sample, and if
/// none of their samples has another fragment of the surface that is nearer to the fragment in Z.
/// Different surfaces never bleed into each other.
///
/// A merged fragment has the Z and channels of its nearest member. Fragments in front leave each
/// sample a remaining transmittance T. The alpha of the merged fragment is the share of T that it
/// covers, alpha = Σ T·a / Σ T over the samples, and its colour is computed the same way. So
/// compositing the merged fragments gives the mean of the samples' composites. Where T is 0 in
/// every sample, the plain mean is used. If opacity is coloured, each channel has its own T. (Deep
/// images hold up at shared edges for the same reason; cf. Egstad, Davis & Lacewell, "Improved Deep
/// Image Compositing Using Subpixel Masks", DigiPro 2015.)
void mergeSamples(std::span<const LayeredImage> samples, const SurfaceOf& surface_of,
                  PixelType color_type, LayeredImage& out);

}  // namespace peeler
