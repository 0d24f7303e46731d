// SPDX-License-Identifier: Apache-2.0
// Composites with a layer limit, order-independent approximations, and composites as layered
// images.
#pragma once

#include <array>
#include <cstddef>
#include <cstdint>

#include <peeler/composite.h>

namespace peeler {

/// Returns the mean of three opacities. If they are equal, the result is exactly their value.
template <class T>
T meanOpacity(T r, T g, T b) {
    return r == g && g == b ? r : static_cast<T>((double{r} + double{g} + double{b}) / 3);
}

/// Stores the colour of one fragment in `colors`. Rounds to half precision if `colors` has that
/// type. Stores coloured opacity only if `colors` has channels for it.
void storeColor(const TintedColor& color, FragmentArray& colors, std::size_t fragment);

/// Composites the rows [y0, y1) of an image like compositeOver(). A few rows at a time stay in the
/// caches; a whole picture is as large as its layers.
void compositeRows(const LayeredImage& image, int y0, int y1,
                   const std::array<float, 4>& background, CompositeImage& out);

/// Composites the nearest `layers` fragments of every pixel (0 = all) with "over", without a
/// background. If `tail` is kBlend, the weighted average of the remaining fragments goes behind
/// them. Overwrites `out`.
void compositeNearest(const LayeredImage& image, std::uint32_t layers, Tail tail,
                      CompositeImage& out);

/// Like the function above, but for an image without a window and on one thread: writes the pixels
/// of `out` from index `first` on. `out` must have room for the pixels, and for coloured opacity if
/// the image has it.
void compositeNearest(const LayeredImage& image, std::uint32_t layers, Tail tail, std::size_t first,
                      CompositeImage& out);

/// Composites n fragments by weighted average (Bavoil & Myers 2008, section 4): C = ΣA·C / ΣA, A =
/// ΣA / n, result C·(1 − (1 − A)^n) + background·(1 − A)^n. If opacity is coloured, A is computed
/// for each channel.
void compositeWeightedAverage(const LayeredImage& image, const std::array<float, 4>& background,
                              CompositeImage& out);

/// Composites by weighted sum (Meshkin 2007): ΣA·C + background·(1 − ΣA). Alpha may exceed 1.
void compositeWeightedSum(const LayeredImage& image, const std::array<float, 4>& background,
                          CompositeImage& out);

/// Converts the colours of a picture that was blended in sRGB-encoded values to linear light: the
/// straight colour is decoded, so that a picture over nothing looks the same.
void decodeColors(CompositeImage& picture);

/// Appends to `out`, which has all or some rows of the image, the extra channels of the first
/// fragment of each pixel. Empty pixels get 0.
void appendNearestChannels(const LayeredImage& image, CompositeImage& out);

/// Converts a composite to a layered image of one layer, in 32-bit float: each pixel with finite Z
/// has one fragment. Compositing this image returns the same composite. `window` has the
/// composite's rows, and may be wider; additional pixels are empty. Overwrites `out`.
void toSingleLayer(const CompositeImage& composite, const Window& window, LayeredImage& out);
inline void toSingleLayer(const CompositeImage& composite, LayeredImage& out) {
    toSingleLayer(composite, composite.window, out);
}

}  // namespace peeler
