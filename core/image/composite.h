// SPDX-License-Identifier: Apache-2.0
// Compositing with limits, the approximations, and composites as layers.
#pragma once

#include <array>
#include <cstddef>
#include <cstdint>

#include <peeler/composite.h>

namespace peeler {

/// The mean of three opacities: exactly theirs if they are equal.
template <class T>
T meanOpacity(T r, T g, T b) {
    return r == g && g == b ? r : static_cast<T>((double{r} + double{g} + double{b}) / 3);
}

/// Stores the colour of one fragment, in half precision if `colors` is of that type; of coloured
/// opacity what `colors` has room for.
void storeColor(const TintedColor& color, FragmentArray& colors, std::size_t fragment);

/// The nearest `layers` fragments of every pixel like that (0 = all), without a background; what is
/// behind them as a weighted average, if `tail` says so. `out` is overwritten.
void compositeNearest(const LayeredImage& image, std::uint32_t layers, Tail tail,
                      CompositeImage& out);

/// The same of an image without a window, which are pixels of `out` from `first` on; on one thread.
/// `out` has room for them, with coloured opacity if the image has it.
void compositeNearest(const LayeredImage& image, std::uint32_t layers, Tail tail, std::size_t first,
                      CompositeImage& out);

/// Weighted average (Bavoil & Myers 2008, section 4) of n fragments: C = ΣA·C / ΣA, A = ΣA / n,
/// C·(1 − (1 − A)^n) + background·(1 − A)^n; with coloured opacity each channel by itself.
void compositeWeightedAverage(const LayeredImage& image, const std::array<float, 4>& background,
                              CompositeImage& out);

/// Weighted sum (Meshkin 2007): ΣA·C + background·(1 − ΣA). Alpha may exceed 1.
void compositeWeightedSum(const LayeredImage& image, const std::array<float, 4>& background,
                          CompositeImage& out);

/// Appends to `out` what the first fragment of every pixel has besides colour and Z; 0 where there
/// is none.
void appendNearestChannels(const LayeredImage& image, CompositeImage& out);

/// A composite as a layered image of one layer, in 32-bit float: a fragment in every pixel whose Z
/// is finite. Compositing that gives the composite again. `window` has the composite's rows, and
/// may be wider: beside the composite there is nothing. `out` is overwritten.
void toSingleLayer(const CompositeImage& composite, const Window& window, LayeredImage& out);
inline void toSingleLayer(const CompositeImage& composite, LayeredImage& out) {
    toSingleLayer(composite, composite.window, out);
}

}  // namespace peeler
