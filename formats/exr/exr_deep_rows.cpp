// SPDX-License-Identifier: Apache-2.0
#include "formats/exr/exr_deep_rows.h"

#include <algorithm>
#include <cstring>

namespace peeler {
namespace {

template <class T>
std::byte* copyComponent(std::span<const T> values, const ExrChannel& channel, std::size_t begin,
                         std::size_t end, std::byte* out) {
    const T* first = values.data() + channel.component;
    for (std::size_t f = begin; f < end; ++f, out += sizeof(T))
        std::memcpy(out, first + f * channel.components, sizeof(T));
    return out;
}

std::byte* copyChannel(const LayeredImage& image, const ExrChannel& channel, std::size_t begin,
                       std::size_t end, std::byte* out) {
    if (channel.source == ExrChannel::kZ)
        return copyComponent(std::span(image.z), channel, begin, end, out);
    const FragmentArray& array = channel.source == ExrChannel::kColor
                                     ? image.color
                                     : image.extra[static_cast<std::size_t>(channel.source)];
    // Bits are copied as they are, so float and uint are alike.
    return pixelTypeSize(channel.type) == sizeof(std::uint16_t)
               ? copyComponent(array.as<std::uint16_t>(), channel, begin, end, out)
               : copyComponent(array.as<std::uint32_t>(), channel, begin, end, out);
}

}  // namespace

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

}  // namespace peeler
