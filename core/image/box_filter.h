// SPDX-License-Identifier: Apache-2.0
// A box filter that shrinks pictures as their rows arrive.
#pragma once

#include <span>
#include <vector>

#include <peeler/composite.h>

namespace peeler {

/// A downscaling filter: every pixel of the result is the average of the area that it covers in the
/// source. A source pixel that straddles several pixels of the result contributes to each in
/// proportion to their overlap. Expects linear light, premultiplied.
class BoxFilter {
  public:
    using Pixel = TintedColor;

    /// The result must be neither wider nor higher than the source.
    BoxFilter(int source_width, int source_height, int width, int height);

    /// Adds the next row of the source, top to bottom.
    void addRow(std::span<const Pixel> row);

    /// Returns the result, row-major. It is complete after the last row.
    const std::vector<Pixel>& pixels() const { return pixels_; }

  private:
    /// A source pixel's split between two adjacent pixels of the result.
    struct Split {
        std::size_t first = 0;
        float in_first = 0, in_next = 0;
    };
    static std::vector<Split> splits(int source, int result);
    void add(const Split& row);

    std::size_t width_;
    std::vector<Split> columns_, rows_;
    std::vector<Pixel> pixels_;
    std::vector<Pixel> narrow_;  ///< the row being added, scaled to the result's width
    std::size_t next_row_ = 0;
};

}  // namespace peeler
