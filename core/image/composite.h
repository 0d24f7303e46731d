// SPDX-License-Identifier: Apache-2.0
// Compositing of captured fragments on the CPU: the reference for every method.
#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <span>
#include <vector>

#include "core/image/layered_image.h"

namespace peeler {

/// What becomes of fragments behind the layers that a limit keeps.
enum class Tail : std::uint8_t {
    kDrop,
    kBlend  ///< composites: blended behind them as a weighted average
};

/// A flattened band: premultiplied linear RGBA in 32-bit float, and the camera Z of each pixel's
/// first fragment (+inf where there is none). Row-major inside `window`.
struct CompositeImage {
    Window window;
    std::vector<std::array<float, 4>> rgba;
    std::vector<float> z;
    std::vector<FragmentArray> extra{};  ///< other quantities, a record a pixel
};

/// Front to back "over" of premultiplied colours (Porter & Duff 1984): C += (1 − A)·c, A += (1 −
/// A)·a, in 32-bit float, in list order. `background` (premultiplied) goes last; all zero adds
/// nothing. `out` is overwritten; its storage is reused.
void compositeOver(const LayeredImage& image, const std::array<float, 4>& background,
                   CompositeImage& out);

/// a in front of b, premultiplied: a + (1 − a.a)·b.
std::array<float, 4> over(const std::array<float, 4>& a, const std::array<float, 4>& b);

/// The colour of one fragment.
std::array<float, 4> colorOf(const LayeredImage& image, std::size_t fragment);
/// Stores the colour of one fragment, in half precision if `colors` is of that type.
void storeColor(const std::array<float, 4>& color, FragmentArray& colors, std::size_t fragment);

/// The nearest `layers` fragments of every pixel like that (0 = all), without a background; what is
/// behind them as a weighted average, if `tail` says so. `out` is overwritten.
void compositeNearest(const LayeredImage& image, std::uint32_t layers, Tail tail,
                      CompositeImage& out);

/// The same of an image without a window, an entry of `rgba` and `z` a pixel; on one thread.
void compositeNearest(const LayeredImage& image, std::uint32_t layers, Tail tail,
                      std::span<std::array<float, 4>> rgba, std::span<float> z);

/// Weighted average (Bavoil & Myers 2008, section 4) of n fragments: C = ΣA·C / ΣA, A = ΣA / n,
/// C·(1 − (1 − A)^n) + background·(1 − A)^n.
void compositeWeightedAverage(const LayeredImage& image, const std::array<float, 4>& background,
                              CompositeImage& out);

/// Weighted sum (Meshkin 2007): ΣA·C + background·(1 − ΣA). Alpha may exceed 1.
void compositeWeightedSum(const LayeredImage& image, const std::array<float, 4>& background,
                          CompositeImage& out);

/// Appends to `out` what the first fragment of every pixel has besides colour and Z; 0 where there
/// is none.
void appendNearestChannels(const LayeredImage& image, CompositeImage& out);

/// A composite as a layered image of one layer, in 32-bit float: a fragment in every pixel whose Z
/// is finite. Compositing that gives the composite again. `out` is overwritten.
void toSingleLayer(const CompositeImage& composite, LayeredImage& out);

}  // namespace peeler
