// SPDX-License-Identifier: Apache-2.0
// "Over" of depth-sorted fragments in 32-bit float, one fixed order of operations.
//
// This file is compiled with -ffp-contract=off: a fused multiply-add would round differently, and a
// file flattened on one machine must have the bits that another machine stored in it.
#include "core/image/composite.h"

// Without the lookup table Imath's conversions are all in the header: core links no OpenEXR.
#define IMATH_HALF_NO_LOOKUP_TABLE
#include <Imath/half.h>

#include <algorithm>
#include <cmath>
#include <limits>
#include <utility>

#include "core/base/parallel.h"

namespace peeler {

std::array<float, 4> over(const std::array<float, 4>& a, const std::array<float, 4>& b) {
    const float rest = 1.0F - a[3];
    std::array<float, 4> sum = a;
    for (std::size_t c = 0; c < 4; ++c)
        sum[c] += rest * b[c];
    return sum;
}

namespace {

using Color = std::array<float, 4>;

Color colorOf(const float* components) {
    return {components[0], components[1], components[2], components[3]};
}
Color colorOf(const std::uint16_t* halfs) {
    return {imath_half_to_float(halfs[0]), imath_half_to_float(halfs[1]),
            imath_half_to_float(halfs[2]), imath_half_to_float(halfs[3])};
}

template <class T>
Color overInOrder(const T* colors, std::size_t count) {
    Color sum{};
    for (std::size_t f = 0; f < count; ++f)
        sum = over(sum, colorOf(colors + 4 * f));
    return sum;
}

template <class T>
Color sumOf(const T* colors, std::size_t count) {
    Color sum{};
    for (std::size_t f = 0; f < count; ++f) {
        const Color color = colorOf(colors + 4 * f);
        for (std::size_t c = 0; c < 4; ++c)
            sum[c] += color[c];
    }
    return sum;
}

template <class T>
Color averageOf(const T* colors, std::size_t count) {
    const Color sum = sumOf(colors, count);
    if (!(sum[3] > 0)) return {sum[0], sum[1], sum[2], 0};  // reflections on glass
    const auto n = static_cast<float>(count);
    const float covered = 1.0F - std::pow(std::max(0.0F, 1.0F - sum[3] / n), n);
    const float scale = covered / sum[3];
    return {sum[0] * scale, sum[1] * scale, sum[2] * scale, covered};
}

/// Where the composites of pixels are written.
struct Pixels {
    Color* rgba;
    float* z;
};

/// Calls one(colors of the pixel, their number) for the pixels [begin, end) of the image; what it
/// returns is put in front of the background.
template <class T, class One>
void compositePixels(const LayeredImage& image, std::size_t begin, std::size_t end,
                     const Color& background, const Pixels& out, const One& one) {
    const T* colors = image.color.as<T>().data();
    for (std::size_t p = begin; p < end; ++p) {
        const std::uint32_t first = image.offsets[p], count = image.count(p);
        out.rgba[p] = over(one(colors + std::size_t{4} * first, count), background);
        out.z[p] = count > 0 ? image.z[first] : std::numeric_limits<float>::infinity();
    }
}

template <class One>
void compositePixels(const LayeredImage& image, std::size_t begin, std::size_t end,
                     const Color& background, const Pixels& out, const One& one) {
    if (image.color.type == PixelType::kFloat) {
        compositePixels<float>(image, begin, end, background, out, one);
    } else {
        compositePixels<std::uint16_t>(image, begin, end, background, out, one);
    }
}

template <class One>
void compositeWith(const LayeredImage& image, const Color& background, CompositeImage& out,
                   const One& one) {
    out.window = image.window;
    out.rgba.resize(image.window.pixels());
    out.z.resize(image.window.pixels());
    const auto width = static_cast<std::size_t>(image.window.width());
    parallelFor(static_cast<std::size_t>(image.window.height()), [&](std::size_t row) {
        compositePixels(image, row * width, (row + 1) * width, background,
                        {out.rgba.data(), out.z.data()}, one);
    });
}

/// The nearest `layers` (0 = all) in order, and the tail behind them.
struct NearestLayers {
    std::size_t limit;
    Tail tail;

    NearestLayers(std::uint32_t layers, Tail tail_mode)
        : limit(layers ? layers : std::numeric_limits<std::size_t>::max()), tail(tail_mode) {}

    template <class T>
    Color operator()(const T* colors, std::size_t count) const {
        const std::size_t kept = std::min(count, limit);
        const Color front = overInOrder(colors, kept);
        if (tail == Tail::kDrop || kept == count) return front;
        return over(front, averageOf(colors + 4 * kept, count - kept));
    }
};

}  // namespace

void compositeOver(const LayeredImage& image, const Color& background, CompositeImage& out) {
    compositeWith(image, background, out,
                  [](const auto* colors, std::size_t count) { return overInOrder(colors, count); });
}

Color colorOf(const LayeredImage& image, std::size_t fragment) {
    return image.color.type == PixelType::kFloat
               ? colorOf(image.color.as<float>().data() + 4 * fragment)
               : colorOf(image.color.as<std::uint16_t>().data() + 4 * fragment);
}

void storeColor(const Color& color, FragmentArray& colors, std::size_t fragment) {
    for (std::size_t c = 0; c < 4; ++c) {
        if (colors.type == PixelType::kFloat) {
            colors.as<float>()[4 * fragment + c] = color[c];
        } else {
            colors.as<std::uint16_t>()[4 * fragment + c] = imath_float_to_half(color[c]);
        }
    }
}

void compositeNearest(const LayeredImage& image, std::uint32_t layers, Tail tail,
                      CompositeImage& out) {
    compositeWith(image, {}, out, NearestLayers(layers, tail));
}

void compositeNearest(const LayeredImage& image, std::uint32_t layers, Tail tail,
                      std::span<Color> rgba, std::span<float> z) {
    compositePixels(image, 0, rgba.size(), {}, {rgba.data(), z.data()},
                    NearestLayers(layers, tail));
}

void compositeWeightedAverage(const LayeredImage& image, const Color& background,
                              CompositeImage& out) {
    compositeWith(image, background, out,
                  [](const auto* colors, std::size_t count) { return averageOf(colors, count); });
}

void compositeWeightedSum(const LayeredImage& image, const Color& background, CompositeImage& out) {
    compositeWith(image, background, out,
                  [](const auto* colors, std::size_t count) { return sumOf(colors, count); });
}

void appendNearestChannels(const LayeredImage& image, CompositeImage& out) {
    for (const FragmentArray& array : image.extra) {
        const std::size_t stride = array.stride();
        FragmentArray nearest{array.channels, array.type, {}};
        nearest.data.assign(image.window.pixels() * stride, std::byte{0});
        for (std::size_t p = 0; p < image.window.pixels(); ++p) {
            if (image.count(p) == 0) continue;
            std::copy_n(array.data.data() + image.offsets[p] * stride, stride,
                        nearest.data.data() + p * stride);
        }
        out.extra.push_back(std::move(nearest));
    }
}

void toSingleLayer(const CompositeImage& composite, LayeredImage& out) {
    const auto width = static_cast<std::size_t>(composite.window.width());
    const auto height = static_cast<std::size_t>(composite.window.height());
    const auto hasFragment = [&](std::size_t p) {
        return composite.z[p] < std::numeric_limits<float>::infinity();
    };
    out.window = composite.window;
    out.offsets.resize(width * height + 1);
    out.offsets[0] = 0;
    for (std::size_t p = 0; p < width * height; ++p)
        out.offsets[p + 1] = out.offsets[p] + (hasFragment(p) ? 1 : 0);
    out.color = {{"R", "G", "B", "A"}, PixelType::kFloat, std::move(out.color.data)};
    out.color.data.resize(out.offsets.back() * sizeof(Color));
    out.extra.clear();
    out.z.resize(out.offsets.back());
    auto* colors = out.color.as<Color>().data();
    parallelFor(height, [&](std::size_t row) {
        for (std::size_t p = row * width; p < (row + 1) * width; ++p) {
            if (!hasFragment(p)) continue;
            out.z[out.offsets[p]] = composite.z[p];
            colors[out.offsets[p]] = composite.rgba[p];
        }
    });
}

}  // namespace peeler
