// SPDX-License-Identifier: Apache-2.0
// A writer of uncompressed PNG files of every colour type, with known bytes.
#pragma once

#include <array>
#include <cstdint>
#include <string>
#include <vector>

#include "support/test_support.h"

namespace peeler::test {

enum class PngColor : std::uint8_t { kGrey = 0, kRgb = 2, kPalette = 3, kGreyAlpha = 4, kRgba = 6 };

struct PngChunk {
    std::string type;
    Bytes data;
};

inline std::uint32_t channelsOf(PngColor color) {
    constexpr std::array<std::uint32_t, 7> kChannels = {1, 0, 3, 1, 2, 0, 4};
    return kChannels[static_cast<std::size_t>(color)];
}

/// Returns the rows, each after a filter byte, in one pass or in seven (§8.2, Adam7). Without
/// samples, returns only the filter bytes.
inline Bytes filteredRows(std::uint32_t width, std::uint32_t height, std::uint32_t bits,
                          const Bytes& samples, bool interlaced) {
    struct Pass {
        std::uint32_t x, y, step_x, step_y;
    };
    constexpr Pass kAll = {0, 0, 1, 1};
    constexpr Pass kAdam7[] = {{0, 0, 8, 8}, {4, 0, 8, 8}, {0, 4, 4, 8}, {2, 0, 4, 4},
                               {0, 2, 2, 4}, {1, 0, 2, 2}, {0, 1, 1, 2}};
    if (samples.empty()) return Bytes(height, 0);
    Bytes rows;
    for (const Pass& pass : interlaced ? std::vector<Pass>(kAdam7, kAdam7 + 7) : std::vector{kAll})
        for (std::uint32_t y = pass.y; y < height && pass.x < width; y += pass.step_y) {
            rows.push_back(0);  // filter type: none
            std::uint32_t count = 0;
            for (std::uint32_t x = pass.x; x < width; x += pass.step_x)
                for (std::uint32_t bit = x * bits; bit < (x + 1) * bits; ++bit, ++count) {
                    if (count % 8 == 0) rows.push_back(0);
                    const std::uint8_t byte = samples[y * ((width * bits + 7) / 8) + bit / 8];
                    rows.back() |=
                        static_cast<std::uint8_t>((byte >> (7 - bit % 8) & 1U) << (7 - count % 8));
                }
        }
    return rows;
}

/// Returns a PNG (ISO/IEC 15948). `samples` are the bytes of all rows without filter bytes;
/// `chunks`, such as PLTE and tRNS, precede the pixels. Supports at most 64 KiB of pixels.
inline Bytes png(std::uint32_t width, std::uint32_t height, PngColor color, std::uint8_t depth,
                 const Bytes& samples, const std::vector<PngChunk>& chunks = {},
                 bool interlaced = false) {
    const auto number = [](Bytes& out, std::uint32_t value) {
        for (const unsigned shift : {24U, 16U, 8U, 0U})
            out.push_back(static_cast<std::uint8_t>(value >> shift));
    };
    const auto chunk = [&](Bytes& out, const std::string& type, const Bytes& data) {
        number(out, static_cast<std::uint32_t>(data.size()));
        const std::size_t begin = out.size();
        out.insert(out.end(), type.begin(), type.end());
        out.insert(out.end(), data.begin(), data.end());
        std::uint32_t crc = 0xFFFFFFFFU;
        for (std::size_t i = begin; i < out.size(); ++i) {
            crc ^= out[i];
            for (int bit = 0; bit < 8; ++bit)
                crc = crc >> 1U ^ (crc & 1U ? 0xEDB88320U : 0U);
        }
        number(out, ~crc);
    };
    const Bytes rows = filteredRows(width, height, depth * channelsOf(color), samples, interlaced);
    // The data is zlib's format (RFC 1950) with one stored block (RFC 1951 §3.2.4).
    const auto size = static_cast<std::uint16_t>(rows.size());
    const auto inverse = static_cast<std::uint16_t>(~size);
    Bytes zlib = {0x78,
                  0x01,
                  0x01,
                  static_cast<std::uint8_t>(size & 0xFF),
                  static_cast<std::uint8_t>(size >> 8),
                  static_cast<std::uint8_t>(inverse & 0xFF),
                  static_cast<std::uint8_t>(inverse >> 8)};
    zlib.insert(zlib.end(), rows.begin(), rows.end());
    std::uint32_t a = 1, b = 0;
    for (const std::uint8_t byte : rows) {
        a = (a + byte) % 65521;
        b = (b + a) % 65521;
    }
    number(zlib, b << 16U | a);

    Bytes out = {0x89, 'P', 'N', 'G', '\r', '\n', 0x1A, '\n'};
    Bytes header;
    number(header, width);
    number(header, height);
    header.insert(header.end(), {depth, static_cast<std::uint8_t>(color), 0, 0,
                                 static_cast<std::uint8_t>(interlaced ? 1 : 0)});
    chunk(out, "IHDR", header);
    for (const PngChunk& extra : chunks)
        chunk(out, extra.type, extra.data);
    chunk(out, "IDAT", zlib);
    chunk(out, "IEND", {});
    return out;
}

}  // namespace peeler::test
