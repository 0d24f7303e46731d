// SPDX-License-Identifier: Apache-2.0
// Writes PNG files of every colour type, uncompressed, byte for byte known.
#pragma once

#include <array>
#include <cstdint>
#include <string>
#include <vector>

namespace peeler::test {

enum class PngColor : std::uint8_t { kGrey = 0, kRgb = 2, kPalette = 3, kGreyAlpha = 4, kRgba = 6 };

using Bytes = std::vector<std::uint8_t>;

struct PngChunk {
    std::string type;
    Bytes data;
};

/// PNG (ISO/IEC 15948). `samples` are the bytes of all rows without filter bytes; `chunks` go
/// before the pixels, e.g. PLTE and tRNS.
inline Bytes png(std::uint32_t width, std::uint32_t height, PngColor color, std::uint8_t depth,
                 const Bytes& samples, const std::vector<PngChunk>& chunks = {}) {
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
    Bytes rows;
    const std::size_t row_bytes = samples.size() / height;
    for (std::uint32_t y = 0; y < height; ++y) {
        rows.push_back(0);  // no filter
        const auto row = samples.begin() + static_cast<std::ptrdiff_t>(y * row_bytes);
        rows.insert(rows.end(), row, row + static_cast<std::ptrdiff_t>(row_bytes));
    }
    // zlib (RFC 1950) around one stored block (RFC 1951 §3.2.4).
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
    header.insert(header.end(), {depth, static_cast<std::uint8_t>(color), 0, 0, 0});
    chunk(out, "IHDR", header);
    for (const PngChunk& extra : chunks)
        chunk(out, extra.type, extra.data);
    chunk(out, "IDAT", zlib);
    chunk(out, "IEND", {});
    return out;
}

}  // namespace peeler::test
