// SPDX-License-Identifier: Apache-2.0
// From the spans of a row to the sorted hits of its rays.
#pragma once

#include <cstddef>
#include <cstdint>
#include <span>
#include <vector>

#include <peeler/view.h>
#include "core/raster/list_sorter.h"
#include "core/raster/span_store.h"

namespace peeler {

/// How many hits the rays of a row have; returns their sum. `counts` has an entry for each ray.
std::uint64_t countHits(const SpanStore& store, std::size_t row, std::span<std::uint32_t> counts);

/// A row of a picture, and where its hits go.
struct HitRow {
    std::size_t row = 0;  ///< of the store
    int x0 = 0, y = 0;    ///< pixel of its first ray, of the picture
    bool perspective = false;
    std::span<const std::uint32_t> offsets;  ///< of each ray's first hit, from any number on
    std::uint32_t end = 0;                   ///< the offset behind the last hit
    float* z = nullptr;                      ///< of all hits of the row
    std::uint32_t* keys = nullptr;
    float* slopes = nullptr;  ///< two a hit (LayeredImage::color), or none
    /// From change of planar depth a pixel to the right and downwards to slopes.
    double slope_scale = 0;

    /// The offset behind a ray's last hit.
    std::uint32_t endOf(std::size_t ray) const {
        return ray + 1 < offsets.size() ? offsets[ray + 1] : end;
    }
};

/// From the change of planar depth to that of buffer depth (Projection::matrix()).
double slopeScale(const Projection& projection);

/// Finds and sorts the hits of rows: one for each thread.
class HitSorter {
  public:
    /// Fills the row's arrays: sorted by Z, then by key. Returns whether every ray has as many hits
    /// as its offsets say.
    bool sortRow(const SpanStore& store, const HitRow& row);

    /// Room for the counts of a row.
    std::span<std::uint32_t> counts(std::size_t rays) {
        if (counts_.size() < rays) counts_.resize(rays);
        return {counts_.data(), rays};
    }

    /// Bytes for a row of so many rays and hits.
    static std::uint64_t bytes(std::uint64_t rays, std::uint64_t hits);

  private:
    template <bool kPerspective, bool kSloped>
    void fill(const SpanStore& store, const HitRow& row);

    void sortLists(const HitRow& row);
    void sortLong(const HitRow& row, std::uint32_t begin, std::uint32_t end);

    std::vector<double> hits_;                  // packed
    std::vector<std::uint32_t> counts_, next_;  // of each ray: where its next hit goes
    std::vector<ListColumn> columns_ = std::vector<ListColumn>(kMostAtOnce);  // of lists at hand
    SortLists sort_ = sortListsFor();
};

}  // namespace peeler
