// SPDX-License-Identifier: Apache-2.0
#include "core/image/statistics.h"

// Without its lookup table, Imath's conversions are header-only, so core need not link OpenEXR.
#define IMATH_HALF_NO_LOOKUP_TABLE
#include <Imath/half.h>

#include <algorithm>
#include <bit>
#include <cmath>

namespace peeler {
namespace {

/// Adds to `broken` every pixel whose Z values satisfy test(begin, end).
template <class Test>
void addWhere(const LayeredImage& band, BrokenPixels& broken, Test&& test) {
    std::size_t pixel = 0;
    for (int y = band.window.y0; y < band.window.y1; ++y) {
        for (int x = band.window.x0; x < band.window.x1; ++x, ++pixel) {
            const float* z = band.z.data();
            if (test(z + band.offsets[pixel], z + band.offsets[pixel + 1])) broken.add(x, y);
        }
    }
}

float stored(float value, PixelType type) {
    return type == PixelType::kHalf ? imath_half_to_float(imath_float_to_half(value)) : value;
}

bool sameBits(float a, float b) {
    return std::bit_cast<std::uint32_t>(a) == std::bit_cast<std::uint32_t>(b);
}

}  // namespace

void findUnsorted(const LayeredImage& band, BrokenPixels& broken) {
    addWhere(band, broken,
             [](const float* z, const float* end) { return !std::is_sorted(z, end); });
}

void findInfinite(const LayeredImage& band, BrokenPixels& broken) {
    addWhere(band, broken, [](const float* z, const float* end) {
        return std::any_of(z, end, [](float depth) { return !std::isfinite(depth); });
    });
}

void findWrongComposite(const LayeredImage& band, const CompositeImage& composite, PixelType type,
                        BrokenPixels& broken) {
    CompositeImage made;
    compositeOver(band, {}, made);
    std::size_t pixel = 0;
    for (int y = band.window.y0; y < band.window.y1; ++y) {
        for (int x = band.window.x0; x < band.window.x1; ++x, ++pixel) {
            bool same = sameBits(made.z[pixel], composite.z[pixel]);
            const TintedColor color = made.colorAt(pixel), there = composite.colorAt(pixel);
            for (std::size_t c = 0; c < color.size(); ++c)
                same = same && sameBits(stored(color[c], type), there[c]);
            if (!same) broken.add(x, y);
        }
    }
}

}  // namespace peeler
