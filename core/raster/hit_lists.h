// SPDX-License-Identifier: Apache-2.0
// Conversion of the spans of a row to the sorted hits of the row's rays.
#pragma once

#include <cstddef>
#include <cstdint>
#include <span>
#include <vector>

#include <peeler/view.h>
#include "core/raster/list_sorter.h"
#include "core/raster/span_store.h"

namespace peeler {

/// The hits of a row. Rays before `begin`, and from `end` on, have none.
struct HitCount {
    std::uint64_t hits = 0;
    std::size_t begin = 0, end = 0;
};

/// Writes the number of hits of each ray of a row to `counts` (one entry per ray).
HitCount countHits(const SpanStore& store, std::size_t row, std::span<std::uint32_t> counts);

/// A row of a picture, and where to write its hits.
struct HitRow {
    std::size_t row = 0;       ///< index of the row in the SpanStore
    std::uint32_t column = 0;  ///< column (Span) of the row's first ray
    int x0 = 0, y = 0;         ///< pixel (in the picture) of the row's first ray
    bool perspective = false;
    /// Offset of each ray's first hit. The offsets may begin at any number.
    std::span<const std::uint32_t> offsets;
    std::uint32_t end = 0;  ///< offset after the row's last hit
    float* z = nullptr;
    std::uint32_t* keys = nullptr;
    float* slopes = nullptr;  ///< two slopes per hit (LayeredImage::color); null if not requested
    /// Factor from the change of planar depth per pixel to a slope (slopeScale()).
    double slope_scale = 0;

    /// Returns the offset after a ray's last hit.
    std::uint32_t endOf(std::size_t ray) const {
        return ray + 1 < offsets.size() ? offsets[ray + 1] : end;
    }
};

/// Returns the factor from changes of planar depth to changes of buffer depth
/// (Projection::matrix()).
double slopeScale(const Projection& projection);

/// A finder and sorter of the hits of rows. Each thread needs its own.
class HitSorter {
  public:
    /// Fills the row's arrays, sorted by Z, then by key. Returns whether every ray's hit count
    /// matches the row's offsets.
    bool sortRow(const SpanStore& store, const HitRow& row);

    /// Returns storage for the counts of a row's rays.
    std::span<std::uint32_t> counts(std::size_t rays) {
        if (counts_.size() < rays) counts_.resize(rays);
        return {counts_.data(), rays};
    }

    /// Returns the bytes that sorting a row with these numbers of rays and hits takes.
    static std::uint64_t bytes(std::uint64_t rays, std::uint64_t hits);

  private:
    template <bool kPerspective, bool kSloped>
    void fill(const SpanStore& store, const HitRow& row);

    void sortLists(const HitRow& row);
    void sortLong(const HitRow& row, std::uint32_t begin, std::uint32_t end);

    std::vector<double> hits_;  // hits of a row, as packed by pack()
    // For each ray: the number of hits, and the offset of the next hit.
    std::vector<std::uint32_t> counts_, next_;
    std::vector<ListColumn> columns_ = std::vector<ListColumn>(kMostAtOnce);  // lists being sorted
    SortLists sort_ = sortListsFor();
};

}  // namespace peeler
