// SPDX-License-Identifier: Apache-2.0
// Sorting of the captured fragments of splats.
#pragma once

#include <cstddef>
#include <cstdint>
#include <vector>

#include <peeler/layered_image.h>
#include <peeler/window.h>
#include "core/raster/list_sorter.h"

namespace peeler {

/// Sorts the fragments of pixels by Z, then by key. Keeps its memory.
class SplatSorter {
  public:
    /// The memory for lists of up to kMostAtOnce fragments.
    static constexpr std::uint64_t kBytes =
        kMostAtOnce * (sizeof(ListColumn) + 2 * sizeof(std::uint32_t) + 7 * sizeof(float));

    /// Sorts the fragments of some pixels of an image. Z is positive; the only extra array has the
    /// keys.
    void sort(const Window& pixels, LayeredImage& image);

  private:
    /// Up to kListsAtOnce pixels.
    void sortTogether(LayeredImage& image, std::size_t first, std::size_t pixels);
    void arrange(LayeredImage& image, std::size_t pixel, std::size_t column);

    SortLists sort_lists_ = sortListsFor();
    std::vector<ListColumn> columns_;
    std::vector<std::uint32_t> order_, keys_;
    std::vector<std::byte> colors_;
};

}  // namespace peeler
