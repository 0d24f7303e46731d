// SPDX-License-Identifier: Apache-2.0
#include "core/splats/splat_channels.h"

#include <algorithm>
#include <numeric>

#include "core/image/channels.h"
#include "core/splats/projected_splats.h"

namespace peeler {

std::uint64_t splatChannelBytes(std::span<const Channel> channels) {
    return sizeof(std::uint32_t) + sizeof(glm::vec3) + shadedComponents(channels) * sizeof(float);
}

void fillSplatChannels(const PosedScene& posed, const View& view, std::span<const Channel> channels,
                       const NextFrame* next, LayeredImage& band) {
    const std::size_t count = band.fragments();
    band.extra.resize(1 + channels.size());
    const std::span<const std::uint32_t> keys = band.extra.front().as<std::uint32_t>();
    // Without base colours, all splats share one record of zeros.
    std::vector<std::uint32_t> records(count);
    std::vector<float> values(shadedComponents(channels));
    std::size_t first = 0;
    for (const Channel channel : channels) {
        if (channel == Channel::kBaseColor) {
            const std::size_t floats = values.size();
            const std::vector<glm::vec3> colors = splatColors(posed, view, keys);
            std::iota(records.begin(), records.end(), 0U);
            values.assign(floats * count, 0);
            for (std::size_t i = 0; i < count; ++i)
                for (int c = 0; c < 3; ++c)
                    values[i * floats + first + static_cast<std::size_t>(c)] = colors[i][c];
            break;
        }
        if (!infoOf(channel).definition.empty()) first += infoOf(channel).components.size();
    }
    fillChannels({posed, view, next, keys, records, values.data()}, channels, band,
                 std::span(band.extra).subspan(1));
}

}  // namespace peeler
