// SPDX-License-Identifier: Apache-2.0
// A writer of valid and invalid KTX 2.0 files with known bytes.
#pragma once

#include <algorithm>
#include <cstdint>
#include <string>
#include <utility>
#include <vector>

#include "support/test_support.h"

namespace peeler::test {

/// Appends a number, little-endian.
inline void appendNumber(Bytes& out, std::uint64_t value, std::size_t size = 4) {
    for (std::size_t i = 0; i < size; ++i)
        out.push_back(static_cast<std::uint8_t>(value >> (8 * i)));
}

/// Overwrites a little-endian number.
inline void setNumber(Bytes& out, std::size_t at, std::uint64_t value, std::size_t size = 4) {
    for (std::size_t i = 0; i < size; ++i)
        out.at(at + i) = static_cast<std::uint8_t>(value >> (8 * i));
}

struct Ktx2Part {
    Bytes bytes;                 ///< the level's bytes as stored
    std::uint64_t unpacked = 0;  ///< the unpacked size in the index of levels
};

/// The parts of a file. The defaults describe a UASTC picture in sRGB without levels.
struct Ktx2File {
    std::uint32_t vk_format = 0, width = 4, height = 4;
    std::uint32_t scheme = 0;  ///< supercompression: 0 none, 1 BasisLZ, 2 Zstandard, 3 ZLIB
    std::uint8_t model = 166, primaries = 1, transfer = 2, flags = 0;
    Bytes channels = {3};  ///< channel of each sample in the descriptor
    std::vector<std::pair<std::string, std::string>> metadata{};
    Bytes global{};
    std::vector<Ktx2Part> levels{};  ///< the levels, the largest first

    /// Returns the offset of the data format descriptor, which follows the index of levels.
    std::size_t descriptorAt() const { return 80 + 24 * levels.size(); }

    Bytes descriptor() const {
        const bool plain = model == 1;
        Bytes out;
        const std::size_t block = 24 + 16 * channels.size();
        appendNumber(out, 4 + block);
        appendNumber(out, 0);
        appendNumber(out, 2 | block << 16U);
        for (const std::uint8_t byte : {model, primaries, transfer, flags})
            out.push_back(byte);
        appendNumber(out, plain ? 0 : 0x0303);
        appendNumber(out, plain ? channels.size() : model == 166 ? 16 : 8);
        appendNumber(out, 0);
        for (std::size_t i = 0; i < channels.size(); ++i) {
            const std::size_t bits = plain ? 8 : model == 166 ? 128 : 64;
            appendNumber(out, i * bits | (bits - 1) << 16U | std::uint64_t{channels[i]} << 24U);
            appendNumber(out, 0);
            appendNumber(out, 0);
            appendNumber(out, plain ? 255 : 0xFFFFFFFFU);
        }
        return out;
    }

    Bytes bytes() const {
        Bytes pairs;
        for (const auto& [key, value] : metadata) {
            appendNumber(pairs, key.size() + 1 + value.size());
            pairs.insert(pairs.end(), key.begin(), key.end());
            pairs.push_back(0);
            pairs.insert(pairs.end(), value.begin(), value.end());
            pairs.resize((pairs.size() + 3) / 4 * 4);
        }
        const Bytes described = descriptor();
        const std::size_t pairs_at = descriptorAt() + described.size();
        const std::size_t global_at = (pairs_at + pairs.size() + 7) / 8 * 8;
        std::size_t at = global_at + global.size();

        Bytes out = {0xAB, 'K', 'T', 'X', ' ', '2', '0', 0xBB, '\r', '\n', 0x1A, '\n'};
        for (const std::uint32_t field :
             {vk_format, 1U, width, height, 0U, 0U, 1U, static_cast<std::uint32_t>(levels.size()),
              scheme, static_cast<std::uint32_t>(descriptorAt()),
              static_cast<std::uint32_t>(described.size()),
              static_cast<std::uint32_t>(pairs.empty() ? 0 : pairs_at),
              static_cast<std::uint32_t>(pairs.size())})
            appendNumber(out, field);
        appendNumber(out, global.empty() ? 0 : global_at, 8);
        appendNumber(out, global.size(), 8);
        // The smallest level is stored first; all are aligned to 16 bytes.
        std::vector<std::size_t> places(levels.size());
        for (std::size_t i = levels.size(); i-- > 0;) {
            places[i] = at = (at + 15) / 16 * 16;
            at += levels[i].bytes.size();
        }
        for (std::size_t i = 0; i < levels.size(); ++i) {
            appendNumber(out, places[i], 8);
            appendNumber(out, levels[i].bytes.size(), 8);
            appendNumber(out, levels[i].unpacked, 8);
        }
        out.insert(out.end(), described.begin(), described.end());
        out.insert(out.end(), pairs.begin(), pairs.end());
        out.resize(global_at);
        out.insert(out.end(), global.begin(), global.end());
        out.resize(at);
        for (std::size_t i = 0; i < levels.size(); ++i)
            std::copy(levels[i].bytes.begin(), levels[i].bytes.end(),
                      out.begin() + static_cast<std::ptrdiff_t>(places[i]));
        return out;
    }
};

/// Returns a UASTC picture of one level, without supercompression.
inline Ktx2File uastcFile(std::uint32_t width, std::uint32_t height, const Bytes& blocks) {
    Ktx2File file;
    file.width = width;
    file.height = height;
    file.levels = {{blocks, blocks.size()}};
    return file;
}

}  // namespace peeler::test
