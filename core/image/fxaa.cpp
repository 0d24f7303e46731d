// SPDX-License-Identifier: Apache-2.0
#include "core/image/fxaa.h"

#include <algorithm>
#include <cmath>
#include <limits>
#include <optional>
#include <utility>
#include <vector>

#include "core/base/parallel.h"
#include "core/base/stage_times.h"
#include "core/image/composite.h"

namespace peeler {
namespace {

using Color = std::array<float, 4>;
using Pixel = glm::ivec2;

// kContrastShare and kLeastContrast are "high quality" and "visible limit" in the white paper.
constexpr float kContrastShare = 1.0F / 8;   ///< minimum contrast as a share of the largest luma
constexpr float kLeastContrast = 1.0F / 32;  ///< minimum contrast as an absolute luma difference
/// The change of luma that ends an edge, as a share of the contrast across the edge.
constexpr float kEndShare = 1.0F / 4;
/// Maximum blend of an isolated pixel (the default in FXAA 3.11).
constexpr float kSubpixel = 0.75F;

/// The maximum difference between a pixel on a straight edge and its surroundings, as a share of
/// the contrast. Allows for rounding.
constexpr float kStraight = 1.0F / 3 + 1e-5F;

/// The perceived brightness of a picture's pixels in front of a background. Beyond the borders, the
/// outermost pixels are repeated.
class Luma {
  public:
    Luma(const CompositeImage& picture, const Color& background) : window_(picture.window) {
        values_.resize(picture.rgba.size());
        const auto width = static_cast<std::size_t>(window_.width());
        const float background_luma = linear(background);
        parallelFor(static_cast<std::size_t>(window_.height()), [&](std::size_t row) {
            for (std::size_t p = row * width; p < (row + 1) * width; ++p) {
                const Color& color = picture.rgba[p];
                const float behind = picture.tinted()
                                         ? linear(throughOf(picture.opacity[p], background))
                                         : (1.0F - color[3]) * background_luma;
                values_[p] = std::sqrt(std::max(0.0F, linear(color) + behind));
            }
        });
    }

    float operator[](Pixel at) const {
        const auto x = std::clamp(at.x, window_.x0, window_.x1 - 1) - window_.x0;
        const auto y = std::clamp(at.y, window_.y0, window_.y1 - 1) - window_.y0;
        return values_[static_cast<std::size_t>(y) * static_cast<std::size_t>(window_.width()) +
                       static_cast<std::size_t>(x)];
    }

  private:
    /// Returns the background as seen through a pixel.
    static Color throughOf(const std::array<float, 3>& opacity, const Color& background) {
        return {(1.0F - opacity[0]) * background[0], (1.0F - opacity[1]) * background[1],
                (1.0F - opacity[2]) * background[2], 0};
    }
    static float linear(const Color& c) { return 0.2126F * c[0] + 0.7152F * c[1] + 0.0722F * c[2]; }

    Window window_;
    std::vector<float> values_;
};

/// The luma of a pixel, its four neighbours and its four corners.
struct Neighbourhood {
    Neighbourhood(const Luma& luma, Pixel p)
        : m(luma[p]),
          n(luma[p + Pixel{0, -1}]),
          s(luma[p + Pixel{0, 1}]),
          w(luma[p + Pixel{-1, 0}]),
          e(luma[p + Pixel{1, 0}]) {
        const auto [least, most] = std::minmax({m, n, s, w, e});
        range = most - least;
        visible = range >= std::max(kLeastContrast, most * kContrastShare) && std::isfinite(range);
        if (!visible) return;
        nw = luma[p + Pixel{-1, -1}];
        ne = luma[p + Pixel{1, -1}];
        sw = luma[p + Pixel{-1, 1}];
        se = luma[p + Pixel{1, 1}];
    }

    /// Return the contrast across rows and the contrast across columns ("Edge detection").
    float acrossRows() const {
        return std::abs((nw + sw) - 2 * w) + std::abs((ne + se) - 2 * e) +
               2 * std::abs((n + s) - 2 * m);
    }
    float acrossColumns() const {
        return std::abs((nw + ne) - 2 * n) + std::abs((sw + se) - 2 * s) +
               2 * std::abs((w + e) - 2 * m);
    }

    /// Returns the blend weight of a pixel that differs from its surroundings ("Sub-pixel
    /// aliasing"). On a straight edge, this difference is a third of the contrast. FXAA 3.11 uses
    /// three quarters of a squared smoothstep from 0, so it blends even pixels on straight edges by
    /// 5 %, which is visible in linear light. This function uses a linear ramp from 1/3 instead,
    /// which stays within 0.1 of 3.11's curve.
    float subpixelShift() const {
        const float sides = (n + s) + (w + e), corners = (nw + se) + (ne + sw);
        const float out = std::abs((2 * sides + corners) / 12 - m) / range;
        return kSubpixel * std::clamp(1.5F * (out - kStraight), 0.0F, 1.0F);
    }

    float m, n, s, w, e;
    float nw = 0, ne = 0, sw = 0, se = 0;
    float range;
    bool visible;  ///< whether the contrast is high enough to filter
};

/// The end of an edge. An edge runs between two lines of pixels, and is searched pair by pair (one
/// pixel from each line). It ends at the first pair whose mean luma differs enough (kEndShare)
/// from the mean luma of the pair where the search begins.
struct EdgeEnd {
    int distance;  ///< distance to the pair, in pixels; kFxaaReach + 1 without a pair
    float change;  ///< mean luma of the pair minus mean luma of the pair where the search begins
};

/// Searches for the end of the edge between p and p + across ("End-of-edge search").
EdgeEnd findEnd(const Luma& luma, Pixel p, Pixel along, Pixel across) {
    const float mean = (luma[p] + luma[p + across]) / 2;
    const float enough = kEndShare * std::abs(luma[p] - luma[p + across]);
    for (int distance = 1; distance <= kFxaaReach; ++distance) {
        p = p + along;
        const float change = (luma[p] + luma[p + across]) / 2 - mean;
        if (std::abs(change) >= enough) return {distance, change};
    }
    return {kFxaaReach + 1, 0};
}

/// Returns the share of p that lies beyond the edge, towards p + across. The edge is approximated
/// by a straight line. The line crosses the pixel boundary in the middle of the run, and is half a
/// pixel off the boundary at both ends.
float edgeShift(const Luma& luma, Pixel p, Pixel across) {
    const Pixel along{across.y, across.x};
    const EdgeEnd a = findEnd(luma, p, -along, across), b = findEnd(luma, p, along, across);
    const EdgeEnd& nearest = a.distance < b.distance ? a : b;
    // Blends p only if, at the nearest end, the mean luma changes towards the luma on the other
    // side of the edge.
    const bool darker = luma[p] < luma[p + across];
    if (darker ? !(nearest.change > 0) : !(nearest.change < 0)) return 0;
    const auto run = static_cast<float>(a.distance + b.distance - 1);
    return 0.5F - (static_cast<float>(nearest.distance) - 0.5F) / run;
}

struct Filtered {
    TintedColor color;
    float z;
};

Filtered pixelOf(const CompositeImage& picture, Pixel at) {
    const Window& w = picture.window;
    const auto x = std::clamp(at.x, w.x0, w.x1 - 1) - w.x0;
    const auto y = std::clamp(at.y, w.y0, w.y1 - 1) - w.y0;
    const auto p = static_cast<std::size_t>(y) * static_cast<std::size_t>(w.width()) +
                   static_cast<std::size_t>(x);
    return {picture.colorAt(p), picture.z[p]};
}

Filtered blend(const Filtered& own, const Filtered& other, float shift) {
    Filtered result = own;
    if (!(shift > 0)) return result;
    for (std::size_t c = 0; c < own.color.size(); ++c)
        result.color[c] += shift * (other.color[c] - own.color[c]);
    if (own.z == std::numeric_limits<float>::infinity()) result.z = other.z;
    return result;
}

Filtered mean(const Filtered& a, const Filtered& b) {
    Filtered result{{}, std::min(a.z, b.z)};
    for (std::size_t c = 0; c < a.color.size(); ++c)
        result.color[c] = (a.color[c] + b.color[c]) / 2;
    return result;
}

/// The filter of a picture. It finds edges in luma, computed over one or two backgrounds.
class Filter {
  public:
    Filter(const CompositeImage& picture, const Color& background)
        : picture_(picture), dark_(picture, background), light_(overWhite(background)) {}

    Filtered operator()(Pixel p) const {
        const Neighbourhood around(dark_, p);
        if (!light_) return filter(dark_, around, p);
        // Some edges have contrast only with black behind the background, others only with white.
        // Uses the luma with more contrast.
        const Neighbourhood other(*light_, p);
        return other.range > around.range ? filter(*light_, other, p) : filter(dark_, around, p);
    }

  private:
    std::optional<Luma> overWhite(Color background) const {
        const float rest = 1.0F - background[3];
        if (!(rest > 0)) return std::nullopt;
        for (std::size_t c = 0; c < 3; ++c)
            background[c] += rest;
        return Luma(picture_, background);
    }

    Filtered filter(const Luma& luma, const Neighbourhood& around, Pixel p) const {
        if (!around.visible) return pixelOf(picture_, p);
        const float rows = around.acrossRows(), columns = around.acrossColumns();
        const float least = around.subpixelShift();
        if (rows > columns) return across(luma, p, {0, 1}, least);
        if (columns > rows) return across(luma, p, {1, 0}, least);
        return mean(across(luma, p, {0, 1}, least), across(luma, p, {1, 0}, least));
    }

    /// Blends p with the neighbour, p + step or p − step, that has more contrast to p. If the
    /// contrasts are equal, uses the mean of both blends.
    Filtered across(const Luma& luma, Pixel p, Pixel step, float least) const {
        const float next = std::abs(luma[p + step] - luma[p]);
        const float previous = std::abs(luma[p + -step] - luma[p]);
        if (next > previous) return towards(luma, p, step, least);
        if (previous > next) return towards(luma, p, -step, least);
        return mean(towards(luma, p, step, least), towards(luma, p, -step, least));
    }

    Filtered towards(const Luma& luma, Pixel p, Pixel step, float least) const {
        return blend(pixelOf(picture_, p), pixelOf(picture_, p + step),
                     std::max(least, edgeShift(luma, p, step)));
    }

    const CompositeImage& picture_;
    Luma dark_;
    /// Luma with white behind `background`; empty if `background` is opaque.
    std::optional<Luma> light_;
};

}  // namespace

void applyFxaa(const CompositeImage& picture, const Color& background, int y0, int y1,
               CompositeImage& out) {
    out.window = {picture.window.x0, y0, picture.window.x1, y1};
    out.resizeColors(picture.tinted());
    out.z.resize(out.window.pixels());
    if (out.window.empty()) return;
    const Filter filter(picture, background);
    const auto width = static_cast<std::size_t>(out.window.width());
    parallelFor(static_cast<std::size_t>(out.window.height()), [&](std::size_t row) {
        for (std::size_t column = 0; column < width; ++column) {
            const Filtered pixel = filter(
                {out.window.x0 + static_cast<int>(column), out.window.y0 + static_cast<int>(row)});
            out.setColor(row * width + column, pixel.color);
            out.z[row * width + column] = pixel.z;
        }
    });
}

namespace {

// The bytes to filter at once, enough to keep many threads busy here and in the encoder.
constexpr std::uint64_t kSliceBytes = 32U << 20;
constexpr int kLeastSlice = 16, kMostSlice = 256;  // minimum and maximum number of rows per slice

// Return the bytes per pixel that kept rows and filtered rows take.
std::uint64_t keptBytes(bool tinted) {
    return CompositeImage::pixelBytes(tinted) + 2 * sizeof(float);  // pixel and two lumas
}
std::uint64_t filteredBytes(bool tinted) {
    // Pixels of filtered_ and layer_, and a list offset.
    return 2 * CompositeImage::pixelBytes(tinted) + sizeof(std::uint32_t);
}

void dropRowsAbove(int y, CompositeImage& image) {
    if (y <= image.window.y0) return;
    const auto pixels = static_cast<std::ptrdiff_t>(y - image.window.y0) * image.window.width();
    image.rgba.erase(image.rgba.begin(), image.rgba.begin() + pixels);
    if (image.tinted()) image.opacity.erase(image.opacity.begin(), image.opacity.begin() + pixels);
    image.z.erase(image.z.begin(), image.z.begin() + pixels);
    image.window.y0 = y;
}

/// Returns the maximum number of rows to filter at once.
int sliceRows(const Plan& plan) {
    const auto row_bytes = static_cast<std::uint64_t>(std::max(1, plan.view.crop.width())) *
                           (keptBytes(plan.tinted) + filteredBytes(plan.tinted));
    return static_cast<int>(
        std::clamp<std::uint64_t>(kSliceBytes / row_bytes, kLeastSlice, kMostSlice));
}

}  // namespace

FxaaFilter::FxaaFilter(std::unique_ptr<Sink> next, const std::array<float, 4>& background)
    : next_(std::move(next)), background_(background) {}

void FxaaFilter::begin(const Plan& plan) {
    next_->begin(plan);
    crop_ = plan.view.crop;
    tinted_ = plan.tinted;
    slice_rows_ = sliceRows(plan);
    next_row_ = crop_.y0;
    kept_ = {{crop_.x0, crop_.y0, crop_.x1, crop_.y0}, {}, {}};
    const auto pixels = static_cast<std::size_t>(crop_.width()) *
                        static_cast<std::size_t>(2 * kFxaaReach + slice_rows_);
    kept_.rgba.reserve(pixels);
    kept_.z.reserve(pixels);
}

void FxaaFilter::write(LayeredImage&& band) {
    {
        const StageTimer timer(times_, "composite");
        compositeOver(band, {}, composite_);
    }
    for (int y = band.window.y0; y < band.window.y1; y += slice_rows_) {
        keep(y, std::min(y + slice_rows_, band.window.y1));
        passOn();
    }
}

void FxaaFilter::keep(int y0, int y1) {
    const StageTimer timer(times_, "composite");
    dropRowsAbove(next_row_ - kFxaaReach, kept_);
    kept_.appendRows(composite_, y0, y1);
    kept_.window.y1 = y1;
}

/// Filters rows and passes them on, as soon as all rows within kFxaaReach of them have arrived.
void FxaaFilter::passOn() {
    const int kept = kept_.window.y1;
    const int end = kept == crop_.y1 ? kept : kept - kFxaaReach;
    while (next_row_ < end) {
        const int row = std::min(next_row_ + slice_rows_, end);
        {
            const StageTimer timer(times_, "composite");
            applyFxaa(kept_, background_, next_row_, row, filtered_);
            toSingleLayer(filtered_, layer_);
        }
        next_->write(std::move(layer_));
        next_row_ = row;
    }
}

void FxaaFilter::finish() {
    next_->finish();
}

SinkMemory FxaaFilter::memory(const Plan& plan) const {
    SinkMemory memory = next_->memory(plan);
    const auto width = static_cast<std::uint64_t>(plan.view.crop.width());
    const auto slice = static_cast<std::uint64_t>(sliceRows(plan));
    constexpr std::uint64_t kOverlap = std::uint64_t{2} * kFxaaReach;
    memory.bytes +=
        width * ((kOverlap + slice) * keptBytes(plan.tinted) + slice * filteredBytes(plan.tinted));
    return memory;
}

StageTimes FxaaFilter::times() const {
    StageTimes times = next_->times();
    add(times, times_);
    return times;
}

}  // namespace peeler
