// SPDX-License-Identifier: Apache-2.0
// What follows from the fragment count of every pixel: layers, their windows, fragments a row.
#pragma once

#include <cstdint>
#include <span>
#include <vector>

#include "core/image/sink.h"

namespace peeler {

/// Accumulates the count pass row by row.
class DepthComplexity {
  public:
    explicit DepthComplexity(const Window& crop);

    /// The counts of row y (display-window coordinates), crop.width() of them, left to right.
    void addRow(int y, std::span<const std::uint32_t> counts);

    /// The rows of a band, which is as wide as the crop.
    void addBand(const LayeredImage& band);

    /// One entry a layer, front to back; the nearest `limit` of them (0 = all).
    std::vector<LayerPlan> layers(std::uint32_t limit = 0) const;
    std::uint64_t counted() const { return counted_; }
    /// Pixels by their number of fragments, from 0 up to the most that a pixel has.
    const std::vector<std::uint64_t>& histogram() const { return histogram_; }
    /// Fragments counted in row y, without the layer limit.
    std::uint64_t rowFragments(int y) const {
        return row_fragments_[static_cast<std::size_t>(y - crop_.y0)];
    }
    /// The most fragments that so many consecutive rows hold together.
    std::uint64_t mostFragments(int rows) const;

  private:
    Window crop_;
    std::vector<Window> windows_;           // by layer
    std::vector<std::uint64_t> histogram_;  // pixels by their number of layers
    std::vector<std::uint64_t> row_fragments_;
    std::uint64_t counted_ = 0;
};

}  // namespace peeler
