// SPDX-License-Identifier: Apache-2.0
#include "core/raster/hit_lists.h"

#include <algorithm>
#include <bit>
#include <cmath>

#include "core/raster/hit_depth.h"

namespace peeler {
namespace {

/// Z above and what orders hits of equal Z below: sorted as one number. Floats order like their
/// bits once those of negative ones are turned.
std::uint64_t packed(float z, std::uint32_t order) {
    const auto bits = std::bit_cast<std::int32_t>(z);
    const auto turned =
        static_cast<std::uint32_t>(bits ^ ((bits >> 31) | std::int32_t(0x80000000)));
    return std::uint64_t{turned} << 32 | order;
}

float zOf(std::uint64_t hit) {
    const auto turned = static_cast<std::int32_t>(hit >> 32);
    return std::bit_cast<float>(turned ^ (~(turned >> 31) | std::int32_t(0x80000000)));
}

}  // namespace

std::uint64_t countHits(const SpanStore& store, std::size_t row, std::span<std::uint32_t> counts) {
    std::fill(counts.begin(), counts.end(), 0U);
    std::uint32_t beyond = 0;  // the end of spans that end with the row
    const std::size_t width = counts.size();
    store.forEachSpan(row, [&](std::span<const Span> spans) {
        for (const Span& span : spans) {
            const std::size_t end = std::size_t{span.last} + 1;
            ++counts[span.first];
            --(end < width ? counts[end] : beyond);
        }
    });
    std::uint64_t sum = 0;
    std::uint32_t count = 0;
    for (std::uint32_t& at : counts) {
        count += at;
        at = count;
        sum += count;
    }
    return sum;
}

template <bool kPerspective, bool kSloped>
void HitSorter::fill(const SpanStore& store, const HitRow& row) {
    const HitTriangles& triangles = store.triangles();
    std::uint64_t* const hits = hits_.data();
    std::uint32_t* const next = next_.data();
    store.forEachSpan(row.row, [&](std::span<const Span> spans) {
        for (std::size_t i = 0; i < spans.size(); ++i) {
            const Span span = spans[i];
            constexpr std::size_t kAhead = 8;
            if (i + kAhead < spans.size())
                __builtin_prefetch(&triangles[spans[i + kAhead].triangle]);
            const HitTriangle triangle = triangles[span.triangle];
            const double start = triangle.along_y * row.y + triangle.at_origin;
            const std::uint32_t order = kSloped ? span.triangle : triangle.key;
            for (std::uint32_t x = span.first; x <= span.last; ++x) {
                const double planar = triangle.along_x * (row.x0 + static_cast<int>(x)) + start;
                hits[next[x]++] = packed(hitZ<kPerspective>(triangle, planar), order);
            }
        }
    });
}

bool HitSorter::sortRow(const SpanStore& store, const HitRow& row) {
    const std::size_t rays = row.offsets.size();
    const std::uint32_t first = row.offsets[0], count = row.end - first;
    if (count == 0) return true;
    if (hits_.size() < count) {
        hits_ = {};
        hits_ = std::vector<std::uint64_t>(count);
        sorted_ = {};
        sorted_ = std::vector<std::uint64_t>(count);
    }
    next_.resize(rays);
    for (std::size_t i = 0; i < rays; ++i)
        next_[i] = row.offsets[i] - first;
    const auto fill_row =
        row.slopes
            ? (row.perspective ? &HitSorter::fill<true, true> : &HitSorter::fill<false, true>)
            : (row.perspective ? &HitSorter::fill<true, false> : &HitSorter::fill<false, false>);
    (this->*fill_row)(store, row);
    bool complete = true;
    std::uint32_t begin = 0;
    for (std::size_t i = 0; i < rays; ++i) {
        const std::uint32_t end = (i + 1 < rays ? row.offsets[i + 1] : row.end) - first;
        complete &= next_[i] == end;
        lists_.sort(hits_.data() + begin, end - begin, sorted_.data() + begin);
        begin = end;
    }
    for (std::uint32_t i = 0; i < count; ++i) {
        row.z[i] = zOf(sorted_[i]);
        row.keys[i] = static_cast<std::uint32_t>(sorted_[i]);
    }
    if (!row.slopes) return complete;
    for (std::uint32_t i = 0; i < count; ++i) {
        const HitTriangle& triangle = store.triangles()[row.keys[i]];
        row.keys[i] = triangle.key;
        row.slopes[2 * i] = static_cast<float>(triangle.along_x * row.slope_scale);
        row.slopes[2 * i + 1] = static_cast<float>(-triangle.along_y * row.slope_scale);
    }
    return complete;
}

double slopeScale(const Projection& projection) {
    const double near = projection.near, far = projection.far;
    if (!projection.perspective) return -1 / (far - near);
    return std::isinf(far) ? near : near * far / (far - near);
}

std::uint64_t HitSorter::bytes(std::uint64_t rays, std::uint64_t hits) {
    return rays * 2 * sizeof(std::uint32_t) + hits * 2 * sizeof(std::uint64_t);
}

}  // namespace peeler
