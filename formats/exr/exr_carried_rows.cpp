// SPDX-License-Identifier: Apache-2.0
#include "formats/exr/exr_carried_rows.h"

#include <algorithm>

namespace peeler {
namespace {

/// Appends the fragments [begin, end) of `from`.
void appendFragments(const LayeredImage& from, std::size_t begin, std::size_t end,
                     LayeredImage& to) {
    const auto append = [&](const FragmentArray& source, FragmentArray& target) {
        const auto* data = source.data.data();
        target.data.insert(target.data.end(), data + begin * source.stride(),
                           data + end * source.stride());
    };
    to.z.insert(to.z.end(), from.z.data() + begin, from.z.data() + end);
    append(from.color, to.color);
    for (std::size_t i = 0; i < from.extra.size(); ++i)
        append(from.extra[i], to.extra[i]);
}

/// Room in `to` for the rows of `from` from y0 on, so that appending them moves nothing.
void reserveRows(const LayeredImage& from, int y0, LayeredImage& to) {
    if (y0 >= from.window.y1) return;
    const std::size_t first = from.pixelIndex(from.window.x0, std::max(y0, from.window.y0));
    const std::size_t pixels = from.window.pixels() - first;
    const std::size_t fragments = from.fragments() - from.offsets[first];
    const auto reserve = [](auto& values, std::size_t more) {
        values.reserve(values.capacity() + more);
    };
    reserve(to.offsets, pixels + 1);
    reserve(to.z, fragments);
    reserve(to.color.data, fragments * to.color.stride());
    for (FragmentArray& array : to.extra)
        reserve(array.data, fragments * array.stride());
}

/// Appends the rows [y0, y1) of `from` below those of `to`, which is as wide.
void appendRows(const LayeredImage& from, int y0, int y1, LayeredImage& to) {
    const std::size_t first = from.pixelIndex(from.window.x0, y0);
    const std::size_t last = from.pixelIndex(from.window.x0, y1);
    const auto base = static_cast<std::uint32_t>(to.fragments());
    for (std::size_t p = first; p < last; ++p) {
        to.offsets.push_back(base + from.offsets[p + 1] - from.offsets[first]);
    }
    appendFragments(from, from.offsets[first], from.offsets[last], to);
    to.window.y1 += y1 - y0;
}

}  // namespace

LayeredImage emptyImage(const LayeredImage& like, int y) {
    LayeredImage image;
    image.window = {like.window.x0, y, like.window.x1, y};
    image.offsets = {0};
    image.color = {like.color.channels, like.color.type, {}};
    for (const auto& array : like.extra)
        image.extra.push_back({array.channels, array.type, {}});
    return image;
}

LayeredImage rowsFrom(int y, const LayeredImage& upper, const LayeredImage& lower) {
    LayeredImage kept = emptyImage(lower, y);
    reserveRows(upper, y, kept);
    reserveRows(lower, y, kept);
    if (y < upper.window.y1) appendRows(upper, y, upper.window.y1, kept);
    appendRows(lower, std::max(y, lower.window.y0), lower.window.y1, kept);
    return kept;
}

}  // namespace peeler
