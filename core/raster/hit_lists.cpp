// SPDX-License-Identifier: Apache-2.0
#include "core/raster/hit_lists.h"

#include <algorithm>
#include <array>
#include <bit>
#include <cmath>
#include <cstring>
#include <limits>

#include "core/base/resize_anew.h"
#include "core/raster/hit_depth.h"

namespace peeler {
namespace {

/// Packs Z (upper half) and the tie-breaking order (lower half) into one double for sorting. The
/// doubles sort by Z first, since the bits of a float, as the upper half of a double, keep their
/// order. If Z is negative, the lower half is inverted, because a greater lower half makes a
/// negative double smaller.
void pack(const FourFloats& z, std::uint32_t order, double* hits) {
    const FourInts none{}, above = std::bit_cast<FourInts>(z);
    const FourInts below = (none + static_cast<std::int32_t>(order)) ^ (above >> 31);
    static_assert(std::endian::native == std::endian::little);
    const FourInts first = __builtin_shufflevector(below, above, 0, 4, 1, 5);
    const FourInts second = __builtin_shufflevector(below, above, 2, 6, 3, 7);
    std::memcpy(hits, &first, sizeof first);
    std::memcpy(hits + 2, &second, sizeof second);
}

void unpack(double hit, float& z, std::uint32_t& order) {
    const auto bits = std::bit_cast<std::uint64_t>(hit);
    const auto above = static_cast<std::int32_t>(bits >> 32);
    z = std::bit_cast<float>(above);
    order = static_cast<std::uint32_t>(bits) ^ static_cast<std::uint32_t>(above >> 31);
}

/// A padding value that sorts behind every hit, even behind a hit with infinite Z.
constexpr double kNoHit = std::numeric_limits<double>::max();

}  // namespace

HitCount countHits(const SpanStore& store, std::size_t row, std::span<std::uint32_t> counts) {
    std::fill(counts.begin(), counts.end(), 0U);
    std::uint32_t beyond = 0;  // dummy target for spans that end at the row's end
    const std::size_t width = counts.size();
    std::uint32_t begin = static_cast<std::uint32_t>(width), last = 0;
    store.forEachSpan(row, [&](std::span<const Span> spans) {
        for (const Span& span : spans) {
            const std::size_t end = std::size_t{span.last} + 1;
            begin = std::min<std::uint32_t>(begin, span.first);
            last = std::max<std::uint32_t>(last, span.last);
            ++counts[span.first];
            --(end < width ? counts[end] : beyond);
        }
    });
    if (begin == width) return {};
    HitCount found{0, begin, std::size_t{last} + 1};
    std::uint32_t count = 0;
    for (std::uint32_t& at : counts.subspan(found.begin, found.end - found.begin)) {
        count += at;
        at = count;
        found.hits += count;
    }
    return found;
}

namespace {

/// A buffer for a few hundred hits in span order. Hits are computed in groups of kWide, so that no
/// branch depends on the length of a span. The next span overwrites the surplus hits of a group.
struct HitRun {
    static constexpr std::size_t kMost = 512, kWide = 4;

    std::array<double, kMost + kWide> hit;
    std::array<std::uint32_t, kMost + kWide> column;
    std::size_t hits = 0;

    /// Moves each hit to its ray's next slot.
    void scatter(double* to, std::uint32_t* next) {
        for (std::size_t i = 0; i < hits; ++i)
            to[next[column[i]]++] = hit[i];
        hits = 0;
    }
};

}  // namespace

template <bool kPerspective, bool kSloped>
void HitSorter::fill(const SpanStore& store, const HitRow& row) {
    const HitTriangles& triangles = store.triangles();
    double* const hits = hits_.data();
    std::uint32_t* const next = next_.data();
    HitRun run;
    store.forEachSpan(row.row, [&](std::span<const Span> spans) {
        for (std::size_t i = 0; i < spans.size(); ++i) {
            const Span span = spans[i];
            constexpr std::size_t kAhead = 8;
            if (i + kAhead < spans.size())
                __builtin_prefetch(&triangles[spans[i + kAhead].triangle]);
            const HitTriangle& triangle = triangles[span.triangle];
            const double along = triangle.along_x;
            const double start = triangle.along_y * row.y + triangle.at_origin;
            const float nearest = triangle.nearest, farthest = triangle.farthest;
            const std::uint32_t order = kSloped ? span.triangle : triangle.key;
            const std::uint32_t last = span.last - row.column;
            for (std::uint32_t x = span.first - row.column; x <= last; x += HitRun::kWide) {
                if (run.hits > HitRun::kMost - HitRun::kWide) run.scatter(hits, next);
                const TwoDoubles none{}, step = {0, 1};
                const TwoDoubles at =
                    none + static_cast<double>(row.x0 + static_cast<int>(x)) + step;
                pack(hitZ<kPerspective>(along * at + start, along * (at + 2) + start, nearest,
                                        farthest),
                     order, run.hit.data() + run.hits);
                std::uint32_t* const column = run.column.data() + run.hits;
                for (std::uint32_t k = 0; k < HitRun::kWide; ++k)
                    column[k] = x + k;
                run.hits += std::min<std::size_t>(HitRun::kWide, last - x + 1);
            }
        }
    });
    run.scatter(hits, next);
}

/// Sorts lists of neighbouring rays together, since their lengths are similar.
void HitSorter::sortLists(const HitRow& row) {
    const std::size_t rays = row.offsets.size();
    const std::uint32_t first = row.offsets[0];
    ListColumn* const columns = columns_.data();
    for (std::size_t ray = 0; ray < rays; ray += kListsAtOnce) {
        std::array<std::uint32_t, kListsAtOnce> begin{}, count{};
        std::uint32_t most = 0;
        for (std::size_t list = 0; list < kListsAtOnce && ray + list < rays; ++list) {
            const std::size_t i = ray + list;
            begin[list] = row.offsets[i] - first;
            count[list] = row.endOf(i) - first - begin[list];
            if (count[list] > kMostAtOnce) {
                sortLong(row, begin[list], begin[list] + count[list]);
                count[list] = 0;
            }
            most = std::max(most, count[list]);
        }
        if (most == 0) continue;
        for (std::size_t list = 0; list < kListsAtOnce; ++list) {
            const double* const hits = hits_.data() + begin[list];
            for (std::uint32_t i = 0; i < count[list]; ++i)
                columns[i][list] = hits[i];
            for (std::uint32_t i = count[list]; i < most; ++i)
                columns[i][list] = kNoHit;
        }
        sort_(columns, most);
        for (std::size_t list = 0; list < kListsAtOnce; ++list) {
            float* const z = row.z + begin[list];
            std::uint32_t* const keys = row.keys + begin[list];
            for (std::uint32_t i = 0; i < count[list]; ++i)
                unpack(columns[i][list], z[i], keys[i]);
        }
    }
}

void HitSorter::sortLong(const HitRow& row, std::uint32_t begin, std::uint32_t end) {
    std::sort(hits_.begin() + begin, hits_.begin() + end);
    for (std::uint32_t i = begin; i < end; ++i)
        unpack(hits_[i], row.z[i], row.keys[i]);
}

bool HitSorter::sortRow(const SpanStore& store, const HitRow& row) {
    const std::size_t rays = row.offsets.size();
    if (rays == 0) return true;
    const std::uint32_t first = row.offsets[0], count = row.end - first;
    if (hits_.size() < count) resizeAnew(hits_, count);
    next_.resize(rays);
    for (std::size_t i = 0; i < rays; ++i)
        next_[i] = row.offsets[i] - first;
    const auto fill_row =
        row.slopes
            ? (row.perspective ? &HitSorter::fill<true, true> : &HitSorter::fill<false, true>)
            : (row.perspective ? &HitSorter::fill<true, false> : &HitSorter::fill<false, false>);
    (this->*fill_row)(store, row);
    bool complete = true;
    for (std::size_t i = 0; i < rays; ++i)
        complete &= next_[i] == row.endOf(i) - first;
    sortLists(row);
    if (!row.slopes) return complete;
    for (std::uint32_t i = 0; i < count; ++i) {
        const HitTriangle& triangle = store.triangles()[row.keys[i]];
        row.keys[i] = triangle.key;
        row.slopes[std::size_t{2} * i] = static_cast<float>(triangle.along_x * row.slope_scale);
        row.slopes[std::size_t{2} * i + 1] =
            static_cast<float>(-triangle.along_y * row.slope_scale);
    }
    return complete;
}

double slopeScale(const Projection& projection) {
    const double near = projection.near, far = projection.far;
    if (!projection.perspective) return -1 / (far - near);
    return std::isinf(far) ? near : near * far / (far - near);
}

std::uint64_t HitSorter::bytes(std::uint64_t rays, std::uint64_t hits) {
    return rays * 2 * sizeof(std::uint32_t) + hits * sizeof(double);
}

}  // namespace peeler
