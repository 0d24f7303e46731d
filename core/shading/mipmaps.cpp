// SPDX-License-Identifier: Apache-2.0
#include "core/shading/mipmaps.h"

#include <algorithm>
#include <array>
#include <cmath>

#include "core/base/parallel.h"
#include "core/base/srgb.h"

namespace peeler {
namespace {

struct Tables {
    std::array<float, 256> decode{};
    std::array<std::uint8_t, 4097> encode{};  // of linear values in steps of 1/4096
};

Tables makeTables(bool srgb) {
    Tables tables;
    for (std::size_t i = 0; i < tables.decode.size(); ++i) {
        const float v = static_cast<float>(i) / 255;
        tables.decode[i] = srgb ? linearFromSrgb(v) : v;
    }
    for (std::size_t i = 0; i < tables.encode.size(); ++i) {
        const float v = static_cast<float>(i) / 4096;
        tables.encode[i] =
            static_cast<std::uint8_t>(std::lround(255 * (srgb ? srgbFromLinear(v) : v)));
    }
    return tables;
}

const Tables& tables(bool srgb) {
    static const Tables srgb_tables = makeTables(true), linear_tables = makeTables(false);
    return srgb ? srgb_tables : linear_tables;
}

constexpr float kHalf = 0.5F;  // to round: std::lround costs more than all the rest of a level

/// Up to three source texels of one destination texel, with their weights (which sum to 1).
struct Taps {
    std::array<int, 3> at{};
    std::array<float, 3> weight{};
};

std::vector<Taps> taps(int source, int destination) {
    std::vector<Taps> all(static_cast<std::size_t>(destination));
    const double scale = static_cast<double>(source) / destination;
    for (int i = 0; i < destination; ++i) {
        const double begin = i * scale, end = (i + 1) * scale;
        for (int t = 0; t < 3; ++t) {
            const int texel = static_cast<int>(begin) + t;
            const double overlap = std::min(end, texel + 1.0) - std::max(begin, double(texel));
            all[static_cast<std::size_t>(i)].at[static_cast<std::size_t>(t)] =
                std::min(texel, source - 1);
            all[static_cast<std::size_t>(i)].weight[static_cast<std::size_t>(t)] =
                static_cast<float>(std::max(0.0, overlap) / scale);
        }
    }
    return all;
}

}  // namespace

int mipmapLevels(int width, int height) {
    int levels = 1;
    while ((std::max(width, height) >> levels) > 0)
        ++levels;
    return levels;
}

Image halved(const Image& image, bool srgb) {
    Image out;
    out.width = std::max(1, image.width / 2);
    out.height = std::max(1, image.height / 2);
    out.rgba.resize(static_cast<std::size_t>(out.width) * static_cast<std::size_t>(out.height) * 4);
    const auto columns = taps(image.width, out.width), rows = taps(image.height, out.height);
    const Tables& color = tables(srgb);
    const Tables& plain = tables(false);
    parallelFor(rows.size(), [&](std::size_t y) {
        std::uint8_t* to = out.rgba.data() + y * static_cast<std::size_t>(out.width) * 4;
        for (const Taps& column : columns) {
            std::array<float, 4> sum{};
            for (std::size_t j = 0; j < 3; ++j) {
                if (rows[y].weight[j] == 0) continue;
                const std::uint8_t* row =
                    image.rgba.data() + static_cast<std::size_t>(rows[y].at[j]) *
                                            static_cast<std::size_t>(image.width) * 4;
                for (std::size_t i = 0; i < 3; ++i) {
                    const float weight = rows[y].weight[j] * column.weight[i];
                    if (weight == 0) continue;
                    const std::uint8_t* texel = row + static_cast<std::size_t>(column.at[i]) * 4;
                    for (std::size_t c = 0; c < 3; ++c)
                        sum[c] += weight * color.decode[texel[c]];
                    sum[3] += weight * plain.decode[texel[3]];
                }
            }
            for (std::size_t c = 0; c < 4; ++c) {
                const auto step = static_cast<std::size_t>(std::min(1.0F, sum[c]) * 4096 + kHalf);
                *to++ = (c < 3 ? color : plain).encode[step];
            }
        }
    });
    return out;
}

}  // namespace peeler
