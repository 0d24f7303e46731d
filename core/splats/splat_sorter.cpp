// SPDX-License-Identifier: Apache-2.0
#include "core/splats/splat_sorter.h"

#include <algorithm>
#include <bit>
#include <cstring>
#include <limits>
#include <span>
#include <utility>

namespace peeler {
namespace {

/// Returns a number whose order is that of Z, with an index in its lower bits. Positive numbers
/// have the order of their bits.
double numberOf(float z, std::uint32_t index) {
    return std::bit_cast<double>(std::uint64_t{std::bit_cast<std::uint32_t>(z)} << 32 | index);
}
std::uint32_t indexOf(double number) {
    return static_cast<std::uint32_t>(std::bit_cast<std::uint64_t>(number));
}
float depthOf(double number) {
    return std::bit_cast<float>(
        static_cast<std::uint32_t>(std::bit_cast<std::uint64_t>(number) >> 32));
}

bool isInOrder(const LayeredImage& image, std::size_t pixel, std::span<const std::uint32_t> keys) {
    for (std::uint32_t f = image.offsets[pixel] + 1; f < image.offsets[pixel + 1]; ++f) {
        const float before = image.z[f - 1], z = image.z[f];
        if (!(before < z || (before == z && keys[f - 1] < keys[f]))) return false;
    }
    return true;
}

}  // namespace

/// Writes the fragments of a pixel in the order of a column.
void SplatSorter::arrange(LayeredImage& image, std::size_t pixel, std::size_t column) {
    const std::uint32_t first = image.offsets[pixel], count = image.count(pixel);
    const std::span<std::uint32_t> keys = image.extra.front().as<std::uint32_t>();
    const std::size_t stride = image.color.stride();
    std::byte* const colors = image.color.data.data() + first * stride;
    keys_.assign(keys.data() + first, keys.data() + first + count);
    colors_.assign(colors, colors + count * stride);
    order_.resize(count);
    for (std::uint32_t i = 0; i < count; ++i) {
        order_[i] = indexOf(columns_[i][column]);
        image.z[first + i] = depthOf(columns_[i][column]);
        // At equal Z, by key: an insertion sort, since there are few.
        for (std::uint32_t k = i; k > 0 && image.z[first + k - 1] == image.z[first + i] &&
                                  keys_[order_[k - 1]] > keys_[order_[k]];
             --k)
            std::swap(order_[k - 1], order_[k]);
    }
    for (std::uint32_t i = 0; i < count; ++i) {
        keys[first + i] = keys_[order_[i]];
        std::memcpy(colors + i * stride, colors_.data() + order_[i] * stride, stride);
    }
}

void SplatSorter::sortTogether(LayeredImage& image, std::size_t first, std::size_t pixels) {
    std::uint32_t most = 0;
    for (std::size_t p = 0; p < pixels; ++p)
        most = std::max(most, image.count(first + p));
    columns_.resize(std::max<std::size_t>(columns_.size(), most));
    for (std::size_t p = 0; p < kListsAtOnce; ++p) {
        const std::uint32_t count = p < pixels ? image.count(first + p) : 0;
        for (std::uint32_t i = 0; i < count; ++i)
            columns_[i][p] = numberOf(image.z[image.offsets[first + p] + i], i);
        for (std::uint32_t i = count; i < most; ++i)
            columns_[i][p] = std::numeric_limits<double>::max();
    }
    sort_lists_(columns_.data(), most);
    for (std::size_t p = 0; p < pixels; ++p)
        arrange(image, first + p, p);
}

void SplatSorter::sort(const Window& pixels, LayeredImage& image) {
    const std::span<const std::uint32_t> keys = image.extra.front().as<std::uint32_t>();
    for (int y = pixels.y0; y < pixels.y1; ++y) {
        for (int x = pixels.x0; x < pixels.x1;) {
            const std::size_t first = image.pixelIndex(x, y);
            const auto together =
                std::min<std::size_t>(kListsAtOnce, static_cast<std::size_t>(pixels.x1 - x));
            bool sorted = true;
            for (std::size_t pixel = first; pixel < first + together; ++pixel)
                sorted = sorted && isInOrder(image, pixel, keys);
            if (!sorted) sortTogether(image, first, together);
            x += static_cast<int>(together);
        }
    }
}

}  // namespace peeler
