// SPDX-License-Identifier: Apache-2.0
// "Over" of depth-sorted fragments in 32-bit float, in a fixed order of operations.
//
// This file is compiled with -ffp-contract=off. A fused multiply-add would round differently, and
// composites from different machines must match bit for bit.
#include "core/image/composite.h"

// Without its lookup table, Imath's conversions are header-only, so core need not link OpenEXR.
#define IMATH_HALF_NO_LOOKUP_TABLE
#include <Imath/half.h>

#include <algorithm>
#include <bit>
#include <cmath>
#include <concepts>
#include <limits>
#include <utility>

#include "core/base/color.h"
#include "core/base/parallel.h"
#include "core/image/stored_colors.h"

namespace peeler::inline v0 {

void CompositeImage::appendRows(const CompositeImage& from, int y0, int y1) {
    const auto width = static_cast<std::size_t>(from.window.width());
    const std::size_t first = static_cast<std::size_t>(y0 - from.window.y0) * width;
    const std::size_t last = static_cast<std::size_t>(y1 - from.window.y0) * width;
    appendColors(from, first, last);
    z.insert(z.end(), from.z.data() + first, from.z.data() + last);
}

void CompositeImage::setRows(const CompositeImage& from, int y0, int y1) {
    window = {from.window.x0, y0, from.window.x1, y1};
    clear();
    appendRows(from, y0, y1);
}

void CompositeImage::clear() {
    rgba.clear();
    opacity.clear();
    z.clear();
}

namespace {

using Color = std::array<float, 4>;

// Compilers do not inline exported functions, which other libraries may replace. So loops call
// these functions instead of over().

Color addBehind(const Color& a, const Color& b) {
    const float rest = 1.0F - a[3];
    Color sum = a;
    for (std::size_t c = 0; c < 4; ++c)
        sum[c] += rest * b[c];
    return sum;
}

TintedColor addBehind(const TintedColor& a, const TintedColor& b) {
    TintedColor sum = a;
    for (std::size_t c = 0; c < 3; ++c) {
        const float rest = 1.0F - a[4 + c];
        sum[c] += rest * b[c];
        sum[4 + c] += rest * b[4 + c];
    }
    sum[3] = meanOpacity(sum[4], sum[5], sum[6]);
    return sum;
}

}  // namespace

std::array<float, 4> over(const std::array<float, 4>& a, const std::array<float, 4>& b) {
    return addBehind(a, b);
}

TintedColor over(const TintedColor& a, const TintedColor& b) {
    return addBehind(a, b);
}

namespace {

template <class C, class T>
C overInOrder(const T* colors, std::size_t count) {
    if constexpr (std::same_as<C, Color>) {
        FourFloats sum{};  // all four components at once
        for (std::size_t f = 0; f < count; ++f)
            sum += (1.0F - sum[3]) * loadFour(colors + 4 * f);
        return std::bit_cast<Color>(sum);
    } else {
        C sum{};
        for (std::size_t f = 0; f < count; ++f)
            sum = addBehind(sum, loadColor<C>(colors + sum.size() * f));
        return sum;
    }
}

template <class C, class T>
C sumOf(const T* colors, std::size_t count) {
    C sum{};
    for (std::size_t f = 0; f < count; ++f) {
        const C color = loadColor<C>(colors + sum.size() * f);
        for (std::size_t c = 0; c < color.size(); ++c)
            sum[c] += color[c];
    }
    return sum;
}

/// Returns the coverage of n averaged fragments whose opacities add up to `sum`.
float averageCoverage(float sum, float n) {
    return 1.0F - std::pow(std::max(0.0F, 1.0F - sum / n), n);
}

Color average(const Color& sum, float n) {
    // Light without opacity, such as a reflection on glass.
    if (!(sum[3] > 0)) return {sum[0], sum[1], sum[2], 0};
    const float covered = averageCoverage(sum[3], n);
    const float scale = covered / sum[3];
    return {sum[0] * scale, sum[1] * scale, sum[2] * scale, covered};
}

TintedColor average(const TintedColor& sum, float n) {
    TintedColor result = sum;
    for (std::size_t c = 0; c < 3; ++c) {
        const float opacity = sum[4 + c];
        result[4 + c] = 0;
        if (!(opacity > 0)) continue;
        result[4 + c] = averageCoverage(opacity, n);
        result[c] = sum[c] * (result[4 + c] / opacity);
    }
    result[3] = meanOpacity(result[4], result[5], result[6]);
    return result;
}

template <class C, class T>
C averageOf(const T* colors, std::size_t count) {
    return average(sumOf<C>(colors, count), static_cast<float>(count));
}

/// Consecutive pixels of an image, and their destination in the composite.
struct Pixels {
    const LayeredImage& image;
    std::size_t begin, end;
    CompositeImage& out;
    std::size_t to = 0;  ///< index of the first of these pixels in `out`
};

/// Calls one(colors, count) for each of these pixels, and composites each result over the
/// background.
template <class C, class T, class One>
void compositePixels(const Pixels& pixels, const C& background, const One& one) {
    const LayeredImage& image = pixels.image;
    const T* colors = image.color.as<T>().data();
    std::size_t to = pixels.to;
    for (std::size_t p = pixels.begin; p < pixels.end; ++p, ++to) {
        const std::uint32_t first = image.offsets[p], count = image.count(p);
        if (count == 0) {
            pixels.out.setColor(to, background);
            pixels.out.z[to] = std::numeric_limits<float>::infinity();
            continue;
        }
        const C color = one.template operator()<C>(colors + background.size() * first, count);
        pixels.out.setColor(to, addBehind(color, background));
        pixels.out.z[to] = image.z[first];
    }
}

template <class C, class One>
void compositePixels(const Pixels& pixels, const C& background, const One& one) {
    if (pixels.image.color.type == PixelType::kFloat) {
        compositePixels<C, float>(pixels, background, one);
    } else {
        compositePixels<C, std::uint16_t>(pixels, background, one);
    }
}

template <class One>
void compositePixels(const Pixels& pixels, const Color& background, const One& one) {
    if (pixels.image.tinted()) {
        compositePixels<TintedColor>(pixels, tinted(background), one);
    } else {
        compositePixels<Color>(pixels, background, one);
    }
}

/// Composites the rows [y0, y1).
template <class One>
void compositeWith(const LayeredImage& image, int y0, int y1, const Color& background,
                   CompositeImage& out, const One& one) {
    out.window = {image.window.x0, y0, image.window.x1, y1};
    out.resizeColors(image.tinted());
    out.z.resize(out.window.pixels());
    const auto width = static_cast<std::size_t>(out.window.width());
    const std::size_t first = image.pixelIndex(out.window.x0, y0);
    parallelFor(static_cast<std::size_t>(out.window.height()), [&](std::size_t row) {
        const std::size_t begin = row * width;
        compositePixels({image, first + begin, first + begin + width, out, begin}, background, one);
    });
}

template <class One>
void compositeWith(const LayeredImage& image, const Color& background, CompositeImage& out,
                   const One& one) {
    compositeWith(image, image.window.y0, image.window.y1, background, out, one);
}

/// Composites the nearest `layers` (0 = all) in order, and puts the tail behind them.
struct NearestLayers {
    std::size_t limit;
    Tail tail;

    NearestLayers(std::uint32_t layers, Tail tail_mode)
        : limit(layers ? layers : std::numeric_limits<std::size_t>::max()), tail(tail_mode) {}

    template <class C, class T>
    C operator()(const T* colors, std::size_t count) const {
        const std::size_t kept = std::min(count, limit);
        const C front = overInOrder<C>(colors, kept);
        if (tail == Tail::kDrop || kept == count) return front;
        return addBehind(front, averageOf<C>(colors + front.size() * kept, count - kept));
    }
};

}  // namespace

void compositeOver(const LayeredImage& image, const Color& background, CompositeImage& out) {
    compositeRows(image, image.window.y0, image.window.y1, background, out);
}

Color colorOf(const LayeredImage& image, std::size_t fragment) {
    if (image.tinted()) return untinted(loadColor<TintedColor>(image.color, fragment));
    return loadColor<Color>(image.color, fragment);
}

TintedColor tintedColorOf(const LayeredImage& image, std::size_t fragment) {
    if (image.tinted()) return loadColor<TintedColor>(image.color, fragment);
    return tinted(loadColor<Color>(image.color, fragment));
}

}  // namespace peeler::inline v0

namespace peeler {

void storeColor(const TintedColor& color, FragmentArray& colors, std::size_t fragment) {
    const std::size_t components = colors.components();
    for (std::size_t c = 0; c < components; ++c) {
        if (colors.type == PixelType::kFloat) {
            colors.as<float>()[components * fragment + c] = color[c];
        } else {
            colors.as<std::uint16_t>()[components * fragment + c] = imath_float_to_half(color[c]);
        }
    }
}

void decodeColors(CompositeImage& picture) {
    const auto width = static_cast<std::size_t>(picture.window.width());
    parallelFor(static_cast<std::size_t>(picture.window.height()), [&](std::size_t row) {
        for (std::array<float, 4>& color : std::span(picture.rgba).subspan(row * width, width)) {
            const float alpha = color[3];
            if (!(alpha > 0)) continue;
            for (std::size_t c = 0; c < 3; ++c)
                color[c] = alpha * linearFromSrgb(color[c] / alpha);
        }
    });
}

void compositeRows(const LayeredImage& image, int y0, int y1, const Color& background,
                   CompositeImage& out) {
    compositeWith(image, y0, y1, background, out,
                  []<class C>(const auto* colors, std::size_t count) {
                      return overInOrder<C>(colors, count);
                  });
}

void compositeNearest(const LayeredImage& image, std::uint32_t layers, Tail tail,
                      CompositeImage& out) {
    compositeWith(image, {}, out, NearestLayers(layers, tail));
}

void compositeNearest(const LayeredImage& image, std::uint32_t layers, Tail tail, std::size_t first,
                      CompositeImage& out) {
    compositePixels({image, 0, image.offsets.size() - 1, out, first}, Color{},
                    NearestLayers(layers, tail));
}

void compositeWeightedAverage(const LayeredImage& image, const Color& background,
                              CompositeImage& out) {
    compositeWith(image, background, out, []<class C>(const auto* colors, std::size_t count) {
        return averageOf<C>(colors, count);
    });
}

void compositeWeightedSum(const LayeredImage& image, const Color& background, CompositeImage& out) {
    compositeWith(image, background, out, []<class C>(const auto* colors, std::size_t count) {
        return sumOf<C>(colors, count);
    });
}

void appendNearestChannels(const LayeredImage& image, CompositeImage& out) {
    const std::size_t first = image.pixelIndex(out.window.x0, out.window.y0);
    const std::size_t pixels = out.window.pixels();
    for (const FragmentArray& array : image.extra) {
        const std::size_t stride = array.stride();
        FragmentArray nearest{array.channels, array.type, {}};
        nearest.data.assign(pixels * stride, std::byte{0});
        for (std::size_t p = 0; p < pixels; ++p) {
            if (image.count(first + p) == 0) continue;
            std::copy_n(array.data.data() + image.offsets[first + p] * stride, stride,
                        nearest.data.data() + p * stride);
        }
        out.extra.push_back(std::move(nearest));
    }
}

void toSingleLayer(const CompositeImage& composite, const Window& window, LayeredImage& out) {
    const Window& own = composite.window;
    const auto own_width = static_cast<std::size_t>(own.width());
    const auto width = static_cast<std::size_t>(window.width());
    const auto height = static_cast<std::size_t>(window.height());
    const auto left = static_cast<std::size_t>(own.x0 - window.x0);
    const auto hasFragment = [&](std::size_t p) {
        return composite.z[p] < std::numeric_limits<float>::infinity();
    };
    out.window = window;
    out.offsets.resize(width * height + 1);
    out.offsets[0] = 0;
    std::uint32_t* offset = out.offsets.data() + 1;
    std::uint32_t fragments = 0;
    for (std::size_t row = 0; row < height; ++row, offset += width) {
        std::fill_n(offset, left, fragments);
        for (std::size_t x = 0; x < own_width; ++x) {
            if (hasFragment(row * own_width + x)) ++fragments;
            offset[left + x] = fragments;
        }
        std::fill(offset + left + own_width, offset + width, fragments);
    }
    out.color = {colorNames(composite.tinted()), PixelType::kFloat, std::move(out.color.data)};
    out.color.data.resize(fragments * out.color.stride());
    out.extra.clear();
    out.z.resize(fragments);
    const std::size_t components = out.color.components();
    float* const colors = out.color.as<float>().data();
    parallelFor(height, [&](std::size_t row) {
        std::size_t fragment = out.offsets[row * width];
        for (std::size_t p = row * own_width; p < (row + 1) * own_width; ++p) {
            if (!hasFragment(p)) continue;
            out.z[fragment] = composite.z[p];
            float* const color = colors + components * fragment++;
            std::copy_n(composite.rgba[p].begin(), 4, color);
            if (composite.tinted()) std::copy_n(composite.opacity[p].begin(), 3, color + 4);
        }
    });
}

}  // namespace peeler
