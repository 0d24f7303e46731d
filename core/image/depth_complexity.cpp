// SPDX-License-Identifier: Apache-2.0
#include "core/image/depth_complexity.h"

#include <algorithm>

namespace peeler {

DepthComplexity::DepthComplexity(const Window& crop)
    : crop_(crop), histogram_(1), row_fragments_(static_cast<std::size_t>(crop.height())) {}

void DepthComplexity::addRow(int y, std::span<const std::uint32_t> counts) {
    // Layer k's window grows by the first and the last pixel of the row with more than k fragments.
    // Scanning from either end, a pixel matters only for the layers above the highest count seen so
    // far: each scan is linear in pixels + layers.
    std::uint64_t total = 0;
    std::uint32_t seen = 0;
    for (std::size_t i = 0; i < counts.size(); ++i) {
        total += counts[i];
        const std::uint32_t layers = counts[i];
        if (layers >= histogram_.size()) histogram_.resize(layers + std::size_t{1});
        ++histogram_[layers];
        if (layers > windows_.size()) windows_.resize(layers);
        const int x = crop_.x0 + static_cast<int>(i);
        for (; seen < layers; ++seen)
            windows_[seen] = unite(windows_[seen], {x, y, x + 1, y + 1});
    }
    std::uint32_t seen_from_right = 0;
    for (std::size_t i = counts.size(); i-- > 0 && seen_from_right < seen;) {
        const int x = crop_.x0 + static_cast<int>(i);
        for (; seen_from_right < counts[i]; ++seen_from_right)
            windows_[seen_from_right] = unite(windows_[seen_from_right], {x, y, x + 1, y + 1});
    }
    row_fragments_[static_cast<std::size_t>(y - crop_.y0)] = total;
    counted_ += total;
}

void DepthComplexity::addBand(const LayeredImage& band) {
    const auto width = static_cast<std::size_t>(crop_.width());
    std::vector<std::uint32_t> counts(width);
    for (int y = band.window.y0; y < band.window.y1; ++y) {
        const std::size_t first = band.pixelIndex(band.window.x0, y);
        for (std::size_t x = 0; x < width; ++x)
            counts[x] = band.count(first + x);
        addRow(y, counts);
    }
}

std::uint64_t DepthComplexity::mostFragments(int rows) const {
    const auto height = static_cast<std::size_t>(std::max(0, rows));
    std::uint64_t most = 0, sum = 0;
    for (std::size_t y = 0; y < row_fragments_.size() && height > 0; ++y) {
        sum += row_fragments_[y];
        if (y >= height) sum -= row_fragments_[y - height];
        most = std::max(most, sum);
    }
    return most;
}

std::vector<LayerPlan> DepthComplexity::layers(std::uint32_t limit) const {
    std::vector<LayerPlan> plans(windows_.size());
    std::uint64_t pixels = 0;
    for (std::size_t k = windows_.size(); k-- > 0;) {
        pixels += histogram_[k + 1];  // all pixels with more than k layers
        plans[k] = {windows_[k], pixels};
    }
    if (limit != 0 && limit < plans.size()) plans.resize(limit);
    return plans;
}

}  // namespace peeler
