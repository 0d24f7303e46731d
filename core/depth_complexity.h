// SPDX-License-Identifier: Apache-2.0
// What follows from the fragment count of every pixel: layers, their windows, fragments a row.
#pragma once

#include <cstdint>
#include <span>
#include <vector>

#include "core/sink.h"

namespace peeler {

/// Accumulates the count pass row by row.
class DepthComplexity {
  public:
    DepthComplexity(const Window& crop, std::uint32_t max_layers);

    /// The counts of row y (display-window coordinates), crop.width() of them, left to right.
    void addRow(int y, std::span<const std::uint32_t> counts);

    /// One entry a layer that will be stored, front to back.
    std::vector<LayerPlan> layers() const;
    std::uint64_t counted() const { return counted_; }
    std::uint64_t stored() const { return stored_; }
    /// Fragments counted in row y, without the layer limit.
    std::uint64_t rowFragments(int y) const {
        return row_fragments_[static_cast<std::size_t>(y - crop_.y0)];
    }
    /// The most fragments that so many consecutive rows hold together.
    std::uint64_t mostFragments(int rows) const;

  private:
    Window crop_;
    std::uint32_t max_layers_;
    std::vector<Window> windows_;           // by layer, capped by max_layers
    std::vector<std::uint64_t> histogram_;  // pixels by their number of layers, capped likewise
    std::vector<std::uint64_t> row_fragments_;
    std::uint64_t counted_ = 0, stored_ = 0;
};

}  // namespace peeler
