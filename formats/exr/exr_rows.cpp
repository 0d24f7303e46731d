// SPDX-License-Identifier: Apache-2.0
#include "formats/exr/exr_rows.h"

#include <Imath/half.h>

#include <array>
#include <cstring>
#include <limits>

#include "core/views/surface_cells.h"

namespace peeler {
namespace {

template <class T>
std::byte* storeNumber(T value, std::byte* out) {
    std::memcpy(out, &value, sizeof value);
    return out + sizeof value;
}

/// One component of the fragments in `row` (kNoFragment: `fill`), to `out`. Returns the end.
template <class T>
std::byte* gatherComponent(std::span<const T> values, const ExrChannel& channel, T fill,
                           std::span<const std::uint32_t> row, std::byte* out) {
    const T* first = values.data() + channel.component;
    for (const std::uint32_t fragment : row) {
        out =
            storeNumber(fragment == kNoFragment ? fill : first[fragment * channel.components], out);
    }
    return out;
}

/// Whether the next channels are those of a colour, as they mostly stand: A, B, G, R.
bool areColor(std::span<const ExrChannel> channels) {
    if (channels.size() < 4) return false;
    for (std::size_t c = 0; c < 4; ++c) {
        if (channels[c].source != ExrChannel::kColor || channels[c].component != 3 - c)
            return false;
    }
    return true;
}

/// These four in one pass, since what takes the time is to reach the fragments.
template <class T>
std::byte* gatherColor(std::span<const T> values, std::span<const std::uint32_t> row,
                       std::byte* out) {
    const std::size_t plane = row.size() * sizeof(T);
    for (const std::uint32_t fragment : row) {
        std::array<T, 4> color{};
        if (fragment != kNoFragment)
            std::memcpy(color.data(), values.data() + std::size_t{4} * fragment, sizeof color);
        for (std::size_t c = 0; c < 4; ++c)
            storeNumber(color[3 - c], out + c * plane);
        out += sizeof(T);
    }
    return out + 3 * plane;
}

}  // namespace

std::size_t findExrFragments(const LayeredImage& image, std::uint32_t k, int x0, int y,
                             std::span<std::uint32_t> row) {
    const std::uint32_t* offsets = image.offsets.data() + image.pixelIndex(x0, y);
    std::size_t found = 0;
    for (std::size_t x = 0; x < row.size(); ++x) {
        const bool has = offsets[x + 1] - offsets[x] > k;
        row[x] = has ? offsets[x] + k : kNoFragment;
        found += has ? 1 : 0;
    }
    return found;
}

std::byte* gatherExrLayer(const LayeredImage& image, std::span<const ExrChannel> channels,
                          std::span<const std::uint32_t> row, std::byte* out) {
    for (std::size_t c = 0; c < channels.size(); ++c) {
        const ExrChannel& channel = channels[c];
        if (channel.source == ExrChannel::kZ) {
            out = gatherComponent(std::span(image.z), channel,
                                  std::numeric_limits<float>::infinity(), row, out);
            continue;
        }
        if (areColor(channels.subspan(c))) {
            out = channel.type == PixelType::kHalf
                      ? gatherColor(image.color.as<std::uint16_t>(), row, out)
                      : gatherColor(image.color.as<float>(), row, out);
            c += 3;
            continue;
        }
        const FragmentArray& array = channel.source == ExrChannel::kColor
                                         ? image.color
                                         : image.extra[static_cast<std::size_t>(channel.source)];
        // Bits are copied as they are, so float and uint are alike.
        out = channel.type == PixelType::kHalf
                  ? gatherComponent<std::uint16_t>(array.as<std::uint16_t>(), channel, 0, row, out)
                  : gatherComponent<std::uint32_t>(array.as<std::uint32_t>(), channel, 0, row, out);
    }
    return out;
}

std::byte* gatherExrComposite(const CompositeImage& image, std::span<const ExrChannel> channels,
                              std::size_t first, std::size_t count, std::byte* out) {
    for (const ExrChannel& channel : channels) {
        if (channel.source >= 0) {
            const FragmentArray& array = image.extra[static_cast<std::size_t>(channel.source)];
            const std::size_t size = pixelTypeSize(channel.type);
            for (std::size_t p = first; p < first + count; ++p, out += size) {
                std::memcpy(out, array.data.data() + p * array.stride() + channel.component * size,
                            size);
            }
            continue;
        }
        for (std::size_t p = first; p < first + count; ++p) {
            if (channel.source == ExrChannel::kCompositeZ) {
                out = storeNumber(image.z[p], out);
            } else if (channel.type == PixelType::kHalf) {
                out = storeNumber(half(image.rgba[p][channel.component]).bits(), out);
            } else {
                out = storeNumber(image.rgba[p][channel.component], out);
            }
        }
    }
    return out;
}

}  // namespace peeler
