// SPDX-License-Identifier: Apache-2.0
// "Over" of depth-sorted fragments in 32-bit float, one fixed order of operations.
//
// This file is compiled with -ffp-contract=off: a fused multiply-add would round differently, and a
// file flattened on one machine must have the bits that another machine stored in it.
#include "core/composite.h"

// Without the lookup table Imath's conversions are all in the header: core links no OpenEXR.
#define IMATH_HALF_NO_LOOKUP_TABLE
#include <Imath/half.h>

#include <algorithm>
#include <limits>

#include "core/parallel.h"

namespace peeler {
namespace {

float toFloat(float value) {
    return value;
}
float toFloat(std::uint16_t half_bits) {
    return imath_half_to_float(half_bits);
}

template <class T>
void compositeRow(const LayeredImage& image, std::size_t first_pixel, std::size_t pixels,
                  const std::array<float, 4>& background, std::uint32_t limit,
                  CompositeImage& out) {
    const T* colors = image.color.as<T>().data();
    for (std::size_t p = first_pixel; p < first_pixel + pixels; ++p) {
        const std::uint32_t begin = image.offsets[p];
        const std::uint32_t end = begin + std::min(image.count(p), limit);
        std::array<float, 4> sum{};
        for (std::uint32_t f = begin; f < end; ++f) {
            const T* color = colors + std::size_t{4} * f;
            const float rest = 1.0F - sum[3];
            for (std::size_t c = 0; c < 4; ++c)
                sum[c] += rest * toFloat(color[c]);
        }
        const float rest = 1.0F - sum[3];
        for (std::size_t c = 0; c < 4; ++c)
            sum[c] += rest * background[c];
        out.rgba[p] = sum;
        out.z[p] = begin < end ? image.z[begin] : std::numeric_limits<float>::infinity();
    }
}

}  // namespace

void compositeOver(const LayeredImage& image, const std::array<float, 4>& background,
                   CompositeImage& out, std::uint32_t limit) {
    out.window = image.window;
    out.rgba.resize(image.window.pixels());
    out.z.resize(image.window.pixels());
    const auto width = static_cast<std::size_t>(image.window.width());
    parallelFor(static_cast<std::size_t>(image.window.height()), [&](std::size_t row) {
        if (image.color.type == PixelType::kFloat) {
            compositeRow<float>(image, row * width, width, background, limit, out);
        } else {
            compositeRow<std::uint16_t>(image, row * width, width, background, limit, out);
        }
    });
}

std::array<float, 4> colorOf(const LayeredImage& image, std::size_t fragment) {
    std::array<float, 4> color{};
    for (std::size_t c = 0; c < 4; ++c) {
        const std::size_t at = 4 * fragment + c;
        color[c] = image.color.type == PixelType::kFloat
                       ? image.color.as<float>()[at]
                       : toFloat(image.color.as<std::uint16_t>()[at]);
    }
    return color;
}

}  // namespace peeler
