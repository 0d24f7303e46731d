// SPDX-License-Identifier: Apache-2.0
// Gathering and copying of fragment channels, component by component.
#include "formats/exr/exr_rows.h"

#include <Imath/half.h>

#include <algorithm>
#include <array>
#include <cstring>
#include <limits>

#include "formats/file/byte_buffer.h"

namespace peeler {
namespace {

/// Writes one component of the fragments in `row` to `out`. Writes `fill` where `row` has
/// kNoFragment. Returns the end of the output.
template <class T>
std::byte* gatherComponent(std::span<const T> values, const ExrChannel& channel, T fill,
                           std::span<const std::uint32_t> row, std::byte* out) {
    for (const std::uint32_t fragment : row) {
        const std::size_t place = fragment * channel.components + channel.component;
        out = storeNumber(fragment == kNoFragment ? fill : values[place], out);
    }
    return out;
}

/// Whether the next four channels are those of a colour without coloured opacity, sorted by name:
/// A, B, G, R.
bool areColor(std::span<const ExrChannel> channels) {
    if (channels.size() < 4 || channels[0].components != kPlainComponents) return false;
    for (std::size_t c = 0; c < 4; ++c) {
        if (channels[c].source != ExrChannel::kColor || channels[c].component != 3 - c)
            return false;
    }
    return true;
}

/// Writes the four channels of a colour in one pass, since fetching the fragments takes most of the
/// time.
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

template <class T>
std::byte* copyComponent(std::span<const T> values, const ExrChannel& channel, std::size_t begin,
                         std::size_t end, std::byte* out) {
    for (std::size_t f = begin; f < end; ++f, out += sizeof(T))
        std::memcpy(out, &values[f * channel.components + channel.component], sizeof(T));
    return out;
}

std::byte* copyChannel(const LayeredImage& image, const ExrChannel& channel, std::size_t begin,
                       std::size_t end, std::byte* out) {
    if (channel.source == ExrChannel::kZ)
        return copyComponent(std::span(image.z), channel, begin, end, out);
    const FragmentArray& array = channel.source == ExrChannel::kColor
                                     ? image.color
                                     : image.extra[static_cast<std::size_t>(channel.source)];
    // Float and uint are handled alike: their bits are copied unchanged.
    return pixelTypeSize(channel.type) == sizeof(std::uint16_t)
               ? copyComponent(array.as<std::uint16_t>(), channel, begin, end, out)
               : copyComponent(array.as<std::uint32_t>(), channel, begin, end, out);
}

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

/// Reserves memory in `to` for the rows of `from` from y0 on, so that appending them does not
/// reallocate.
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

}  // namespace

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
        // Float and uint are handled alike: their bits are copied unchanged.
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
        const bool is_opacity = channel.component >= kPlainComponents;
        for (std::size_t p = first; p < first + count; ++p) {
            if (channel.source == ExrChannel::kCompositeZ) {
                out = storeNumber(image.z[p], out);
                continue;
            }
            const float value = is_opacity ? image.opacity[p][channel.component - kPlainComponents]
                                           : image.rgba[p][channel.component];
            out = channel.type == PixelType::kHalf ? storeNumber(half(value).bits(), out)
                                                   : storeNumber(value, out);
        }
    }
    return out;
}

std::vector<ExrChannel> deepChannels(const FragmentArray& array, int source) {
    std::vector<ExrChannel> channels;
    for (std::size_t c = 0; c < array.components(); ++c)
        channels.push_back({array.channels[c], array.type, source, c, array.components()});
    return channels;
}

void packDeepRow(const LayeredImage& image, std::span<const ExrChannel> channels,
                 const Window& window, int y, ExrChunkPacker& packer, ExrDeepChunk& chunk) {
    const auto width = static_cast<std::size_t>(window.width());
    const std::uint32_t* offsets = image.offsets.data() + image.pixelIndex(window.x0, y);
    std::byte* out = packer.raw(width * sizeof(std::uint32_t)).data();
    for (std::size_t x = 1; x <= width; ++x, out += sizeof(std::uint32_t)) {
        const std::uint32_t samples = offsets[x] - offsets[0];
        std::memcpy(out, &samples, sizeof samples);
    }
    packer.pack(chunk.counts);

    const std::size_t begin = offsets[0], end = offsets[width];
    std::size_t bytes = 0;
    for (const ExrChannel& channel : channels)
        bytes += (end - begin) * pixelTypeSize(channel.type);
    chunk.unpacked = bytes;
    out = packer.raw(bytes).data();
    for (const ExrChannel& channel : channels)
        out = copyChannel(image, channel, begin, end, out);
    packer.pack(chunk.samples);
}

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
