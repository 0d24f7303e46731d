// SPDX-License-Identifier: Apache-2.0
#include "core/gather.h"

#include <algorithm>
#include <cstring>
#include <numeric>
#include <vector>

#include "core/parallel.h"

namespace peeler {
namespace {

/// Sorts the lists of pixels that follow one another. Neighbours mostly see the same surfaces in
/// the same order: each list begins with the order of the one before it, and an insertion sort has
/// next to nothing left to do. Where it has a lot, a general sort takes over.
class ListSorter {
  public:
    /// The order of the fragments, nearest first; until the next call. Depths are not negative.
    const std::uint32_t* sort(const std::uint32_t* words, std::size_t stride, std::size_t count) {
        if (order_.size() != count) {
            order_.resize(count);
            std::iota(order_.begin(), order_.end(), 0U);
            keys_.resize(count);
        }
        std::size_t moves_left = kMoves * count;
        for (std::size_t i = 0; i < count; ++i) {
            const std::uint32_t fragment = order_[i];
            const std::uint64_t key = keyOf(words + fragment * stride);
            std::size_t at = i;
            for (; at > 0 && keys_[at - 1] > key; --at) {
                keys_[at] = keys_[at - 1];
                order_[at] = order_[at - 1];
            }
            keys_[at] = key;
            order_[at] = fragment;
            if (i - at > moves_left) {
                sortAnew(words, stride);
                break;
            }
            moves_left -= i - at;
        }
        return order_.data();
    }

  private:
    static constexpr std::size_t kMoves = 12;  ///< a fragment; more cost more than a general sort

    /// Grows from the nearest to the farthest, among equal depths in draw order. Floats that are
    /// not negative order like their bits.
    static std::uint64_t keyOf(const std::uint32_t* fragment) {
        return std::uint64_t{~fragment[0]} << 32 | fragment[1];
    }

    void sortAnew(const std::uint32_t* words, std::size_t stride) {
        std::sort(order_.begin(), order_.end(), [&](std::uint32_t a, std::uint32_t b) {
            return keyOf(words + a * stride) < keyOf(words + b * stride);
        });
    }

    std::vector<std::uint32_t> order_;
    std::vector<std::uint64_t> keys_;
};

/// resize() for contents that will be overwritten: never holds the old and the new storage at once.
template <class T>
void resizeAnew(std::vector<T>& values, std::size_t size) {
    if (values.capacity() < size) {
        values = {};
        values.reserve(size);
    }
    values.resize(size);
}

/// What becomes of the pixels of a row.
struct Row {
    std::size_t first_pixel, pixels;
    LayeredImage& out;
    std::uint32_t* sources;  ///< of all fragments of `out`, or null
};

template <std::size_t kColorWords>
void gatherRow(const CapturedFragments& captured, const Row& row, ListSorter& sorter) {
    constexpr std::size_t kStride = 2 + kColorWords;
    LayeredImage& out = row.out;
    auto* const colors = reinterpret_cast<std::uint32_t*>(out.color.data.data());
    for (std::size_t p = row.first_pixel; p < row.first_pixel + row.pixels; ++p) {
        const std::uint32_t begin = captured.first[p], count = captured.first[p + 1] - begin;
        if (count == 0) continue;
        const std::uint32_t* const words = captured.words + begin * kStride;
        const std::uint32_t* const order = sorter.sort(words, kStride, count);
        const std::uint32_t to = out.offsets[p], kept = out.offsets[p + 1] - to;
        for (std::uint32_t k = 0; k < kept; ++k) {
            const std::uint32_t* const fragment = words + order[k] * kStride;
            std::memcpy(&out.z[to + k], fragment, sizeof(float));
            if (kColorWords > 0) {
                std::memcpy(colors + (to + k) * kColorWords, fragment + 2,
                            kColorWords * sizeof(std::uint32_t));
            }
            if (row.sources) row.sources[to + k] = begin + order[k];
        }
    }
}

using GatherRow = void (*)(const CapturedFragments&, const Row&, ListSorter&);

GatherRow gatherRowOf(std::size_t stride) {
    if (stride == 2) return gatherRow<0>;
    return stride == 4 ? gatherRow<2> : gatherRow<4>;
}

}  // namespace

void gather(const CapturedFragments& captured, const Projection& projection,
            std::uint32_t max_layers, LayeredImage& out, std::vector<std::uint32_t>* sources) {
    const std::size_t pixels = out.window.pixels();
    resizeAnew(out.offsets, pixels + 1);
    out.offsets[0] = 0;
    for (std::size_t p = 0; p < pixels; ++p) {
        std::uint32_t kept = captured.first[p + 1] - captured.first[p];
        if (max_layers) kept = std::min(kept, max_layers);
        out.offsets[p + 1] = out.offsets[p] + kept;
    }
    const std::size_t fragments = out.offsets[pixels];
    resizeAnew(out.z, fragments);
    resizeAnew(out.color.data, fragments * out.color.stride());
    if (sources) resizeAnew(*sources, fragments);

    const GatherRow gather_row = gatherRowOf(captured.stride);
    const auto width = static_cast<std::size_t>(out.window.width());
    const auto rows = static_cast<std::size_t>(out.window.height());
    parallelFor(rows, [&](std::size_t row) {
        thread_local ListSorter sorter;
        const std::size_t first = row * width;
        gather_row(captured, {first, width, out, sources ? sources->data() : nullptr}, sorter);
        const std::uint32_t begin = out.offsets[first], end = out.offsets[first + width];
        projection.toLinearZ({out.z.data() + begin, end - begin});
    });
}

}  // namespace peeler
