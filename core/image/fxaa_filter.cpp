// SPDX-License-Identifier: Apache-2.0
// Bands go through in slices, so that a large band takes no more room than a small one.
#include "core/image/fxaa_filter.h"

#include <algorithm>
#include <utility>

#include "core/image/fxaa.h"

namespace peeler {
namespace {

// Large enough to keep many threads busy, here and where the slice is encoded.
constexpr std::uint64_t kSliceBytes = 32U << 20;
constexpr int kLeastSlice = 16, kMostSlice = 256;  // rows

constexpr std::uint64_t kCompositeBytes = sizeof(float) * (4 + 1);              // a pixel
constexpr std::uint64_t kKeptPixelBytes = kCompositeBytes + 2 * sizeof(float);  // and its two lumas
constexpr std::uint64_t kFilteredBytes = 2 * kCompositeBytes + sizeof(std::uint32_t);  // as a layer

void appendRows(const CompositeImage& from, int y0, int y1, CompositeImage& to) {
    const auto width = static_cast<std::ptrdiff_t>(from.window.width());
    const auto first = (y0 - from.window.y0) * width, last = (y1 - from.window.y0) * width;
    to.rgba.insert(to.rgba.end(), from.rgba.begin() + first, from.rgba.begin() + last);
    to.z.insert(to.z.end(), from.z.begin() + first, from.z.begin() + last);
    to.window.y1 += y1 - y0;
}

void dropRowsAbove(int y, CompositeImage& image) {
    if (y <= image.window.y0) return;
    const auto pixels = static_cast<std::ptrdiff_t>(y - image.window.y0) * image.window.width();
    image.rgba.erase(image.rgba.begin(), image.rgba.begin() + pixels);
    image.z.erase(image.z.begin(), image.z.begin() + pixels);
    image.window.y0 = y;
}

}  // namespace

FxaaFilter::FxaaFilter(std::unique_ptr<Sink> next, const std::array<float, 4>& background)
    : next_(std::move(next)), background_(background) {}

void FxaaFilter::begin(const Plan& plan) {
    next_->begin(plan);
    crop_ = plan.view.crop;
    const auto row_bytes =
        static_cast<std::uint64_t>(std::max(1, crop_.width())) * (kKeptPixelBytes + kFilteredBytes);
    slice_rows_ = static_cast<int>(
        std::clamp<std::uint64_t>(kSliceBytes / row_bytes, kLeastSlice, kMostSlice));
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
    appendRows(composite_, y0, y1, kept_);
}

/// Hands on the rows that have all others they need.
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

SinkMemory FxaaFilter::memory() const {
    SinkMemory memory = next_->memory();
    const auto width = static_cast<std::uint64_t>(crop_.width());
    const auto slice = static_cast<std::uint64_t>(slice_rows_);
    constexpr std::uint64_t kOverlap = std::uint64_t{2} * kFxaaReach;
    memory.bytes += width * ((kOverlap + slice) * kKeptPixelBytes + slice * kFilteredBytes);
    return memory;
}

StageTimes FxaaFilter::times() const {
    StageTimes times = next_->times();
    add(times, times_);
    return times;
}

}  // namespace peeler
