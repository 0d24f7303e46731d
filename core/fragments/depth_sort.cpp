// SPDX-License-Identifier: Apache-2.0
#include "core/fragments/depth_sort.h"

#include <algorithm>
#include <cstring>
#include <numeric>
#include <utility>
#include <vector>

#include "core/base/parallel.h"
#include "core/base/resize_anew.h"
#include "core/image/composite.h"

namespace peeler {
namespace {

/// A sorter for the lists of consecutive pixels. Adjacent pixels mostly see the same surfaces in
/// the same order. So an insertion sort that starts from the order of the previous list needs few
/// moves. If it needs too many moves, std::sort takes over.
class ListSorter {
  public:
    /// Returns the order of the fragments, nearest first; valid until the next call. Depths must
    /// not be negative.
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
            const std::pair placed(key, fragment);
            for (; at > 0 && std::pair(keys_[at - 1], order_[at - 1]) > placed; --at) {
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
    /// The maximum number of moves per fragment for the insertion sort. With more moves, std::sort
    /// is faster.
    static constexpr std::size_t kMoves = 12;

    /// Returns a sort key. Keys increase from the nearest fragment to the farthest and, at equal
    /// depths, with their keys. The bits of non-negative floats sort like the floats.
    static std::uint64_t keyOf(const std::uint32_t* fragment) {
        return std::uint64_t{~fragment[0]} << 32 | fragment[1];
    }

    void sortAnew(const std::uint32_t* words, std::size_t stride) {
        std::sort(order_.begin(), order_.end(), [&](std::uint32_t a, std::uint32_t b) {
            return std::pair(keyOf(words + a * stride), a) <
                   std::pair(keyOf(words + b * stride), b);
        });
    }

    std::vector<std::uint32_t> order_;
    std::vector<std::uint64_t> keys_;
};

/// The pixels of a row, and where to write their sorted fragments.
struct SortedRow {
    std::size_t first_pixel, pixels;  ///< the row's pixels in the captured arrays
    std::size_t to_pixel;             ///< index of the first pixel in `out`
    LayeredImage& out;
    std::uint32_t* sources;  ///< captured index of each fragment of `out`; may be null
};

/// Sorts the lists of a row. `kStride`: captured words per fragment; `kColorBytes`: stored bytes of
/// colour per fragment.
template <std::size_t kStride, std::size_t kColorBytes>
void sortRow(const CapturedFragments& captured, const SortedRow& row, ListSorter& sorter) {
    LayeredImage& out = row.out;
    std::byte* const colors = out.color.data.data();
    const std::uint32_t* const offsets = out.offsets.data() + row.to_pixel;
    for (std::size_t p = 0; p < row.pixels; ++p) {
        const std::uint32_t begin = captured.first[row.first_pixel + p];
        const std::uint32_t count = captured.first[row.first_pixel + p + 1] - begin;
        if (count == 0) continue;
        const std::uint32_t* const words = captured.words + begin * kStride;
        const std::uint32_t* const order = sorter.sort(words, kStride, count);
        const std::uint32_t to = offsets[p], kept = std::min(offsets[p + 1] - to, count);
        for (std::uint32_t k = 0; k < kept; ++k) {
            const std::uint32_t* const fragment = words + order[k] * kStride;
            std::memcpy(&out.z[to + k], fragment, sizeof(float));
            if (kColorBytes > 0)
                std::memcpy(colors + (to + k) * kColorBytes, fragment + 2, kColorBytes);
            if (row.sources) row.sources[to + k] = begin + order[k];
        }
    }
}

using SortRow = void (*)(const CapturedFragments&, const SortedRow&, ListSorter&);

/// Returns the sortRow() for captured fragments of `stride` words and stored colours of
/// `color_bytes` bytes: half or float, plain or tinted.
SortRow rowSorterOf(std::size_t stride, std::size_t color_bytes) {
    if (stride == 2) return sortRow<2, 0>;
    if (stride == 4) return sortRow<4, 8>;
    if (stride == 10) return sortRow<10, kTintedComponents * sizeof(float)>;
    return color_bytes == 16 ? sortRow<6, 16>
                             : sortRow<6, kTintedComponents * sizeof(std::uint16_t)>;
}

/// Makes room in `out` for the nearest `max_layers` (0 = all) fragments of each of `pixels` pixels,
/// beginning with pixel `first`. If `behind` is given, also makes room for the opaque fragments in
/// it.
void layOut(const CapturedFragments& captured, std::size_t first, std::size_t pixels,
            std::uint32_t max_layers, LayeredImage& out, const std::uint32_t* behind = nullptr) {
    resizeAnew(out.offsets, pixels + 1);
    out.offsets[0] = 0;
    for (std::size_t p = 0; p < pixels; ++p) {
        std::uint32_t kept = captured.first[first + p + 1] - captured.first[first + p];
        if (behind && behind[OpaqueFragments::kWords * p] != 0) ++kept;
        if (max_layers) kept = std::min(kept, max_layers);
        out.offsets[p + 1] = out.offsets[p] + kept;
    }
    resizeAnew(out.z, out.offsets[pixels]);
    resizeAnew(out.color.data, out.offsets[pixels] * out.color.stride());
}

/// Writes the opaque fragment of each pixel of a row, if there is one, to the end of the pixel's
/// list. If opacity is coloured, the fragment's alpha serves as the opacity of each channel.
void addBehind(const std::uint32_t* fragments, const std::uint32_t* colors, LayeredImage& lists) {
    constexpr std::size_t kWords = OpaqueFragments::kWords;
    const std::size_t number = pixelTypeSize(lists.color.type), stride = lists.color.stride();
    const std::size_t plain = kPlainComponents * number;
    for (std::size_t p = 0; p + 1 < lists.offsets.size(); ++p) {
        const std::uint32_t* const fragment = fragments + kWords * p;
        if (fragment[0] == 0) continue;
        const std::size_t at = lists.offsets[p + 1] - std::size_t{1};
        std::memcpy(&lists.z[at], fragment, sizeof(float));
        std::byte* const color = lists.color.data.data() + at * stride;
        std::memcpy(color, colors ? colors + kWords * p : fragment + 2, plain);
        for (std::size_t to = plain; to < stride; to += number)
            std::memcpy(color + to, color + plain - number, number);
    }
}

}  // namespace

void depthSort(const CapturedFragments& captured, const Projection& projection,
               std::uint32_t max_layers, LayeredImage& out, std::vector<std::uint32_t>* sources) {
    layOut(captured, 0, out.window.pixels(), max_layers, out);
    if (sources) resizeAnew(*sources, out.fragments());

    const SortRow sort_row = rowSorterOf(captured.stride, out.color.stride());
    const auto width = static_cast<std::size_t>(out.window.width());
    const auto rows = static_cast<std::size_t>(out.window.height());
    ObjectPool<ListSorter> sorters;
    parallelFor(rows, [&](std::size_t row) {
        const std::size_t first = row * width;
        sorters.with([&](ListSorter& sorter) {
            sort_row(captured, {first, width, first, out, sources ? sources->data() : nullptr},
                     sorter);
        });
        const std::uint32_t begin = out.offsets[first], end = out.offsets[first + width];
        projection.toLinearZ({out.z.data() + begin, end - begin});
    });
}

void depthSortComposite(const CapturedFragments& captured, const Projection& projection,
                        std::uint32_t layers, Tail tail, const FragmentArray& color,
                        CompositeImage& out, const OpaqueFragments* behind) {
    const std::size_t pixels = out.window.pixels();
    resizeAnew(out.rgba, pixels);
    resizeAnew(out.opacity, color.components() == kTintedComponents ? pixels : 0);
    resizeAnew(out.z, pixels);
    const std::uint32_t needed = tail == Tail::kBlend ? 0 : layers;
    const SortRow sort_row = rowSorterOf(captured.stride, color.stride());
    const auto width = static_cast<std::size_t>(out.window.width());
    struct Scratch {
        ListSorter sorter;
        LayeredImage lists;
    };
    ObjectPool<Scratch> scratch;
    const auto composite_row = [&](std::size_t row, Scratch& of_row) {
        LayeredImage& lists = of_row.lists;
        const std::size_t first = row * width;
        lists.color.type = color.type;
        lists.color.channels = color.channels;
        const std::size_t up = first * OpaqueFragments::kWords;
        const std::uint32_t* const opaque = behind ? behind->fragments - up : nullptr;
        layOut(captured, first, width, needed, lists, opaque);
        sort_row(captured, {first, width, 0, lists, nullptr}, of_row.sorter);
        if (opaque) addBehind(opaque, behind->colors ? behind->colors - up : nullptr, lists);
        projection.toLinearZ(lists.z);
        compositeNearest(lists, layers, tail, first, out);
    };
    parallelFor(static_cast<std::size_t>(out.window.height()), [&](std::size_t row) {
        scratch.with([&](Scratch& of_row) { composite_row(row, of_row); });
    });
}

}  // namespace peeler
