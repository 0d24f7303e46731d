// SPDX-License-Identifier: Apache-2.0
// zlib or run lengths, then sums of differences, then bytes together again.
#include "formats/exr_unpack.h"

#include <libdeflate.h>

#include <algorithm>
#include <cstring>
#include <memory>

namespace peeler {
namespace {

bool inflate(std::span<const std::byte> packed, std::span<std::byte> out) {
    const std::unique_ptr<libdeflate_decompressor, void (*)(libdeflate_decompressor*)> inflater(
        libdeflate_alloc_decompressor(), libdeflate_free_decompressor);
    // Without a place for the actual size the result must fill `out`.
    return inflater &&
           libdeflate_zlib_decompress(inflater.get(), packed.data(), packed.size(), out.data(),
                                      out.size(), nullptr) == LIBDEFLATE_SUCCESS;
}

/// See packRuns() in exr_chunks.cpp.
bool unpackRuns(std::span<const std::byte> packed, std::span<std::byte> out) {
    std::size_t filled = 0;
    for (std::size_t i = 0; i < packed.size();) {
        // A signed byte: from 128 on it is code − 256.
        const auto code = std::to_integer<std::size_t>(packed[i++]);
        const bool literal = code >= 128;
        const std::size_t count = literal ? 256 - code : code + 1;
        const std::size_t stored = literal ? count : 1;
        if (count > out.size() - filled || stored > packed.size() - i) return false;
        if (literal) {
            std::memcpy(out.data() + filled, packed.data() + i, count);
        } else {
            std::fill_n(out.begin() + static_cast<std::ptrdiff_t>(filled), count, packed[i]);
        }
        filled += count;
        i += stored;
    }
    return filled == out.size();
}

/// The inverse of ExrChunkPacker's filter. Destroys `filtered`.
void unfilter(std::span<std::byte> filtered, std::span<std::byte> out) {
    auto* from = reinterpret_cast<std::uint8_t*>(filtered.data());
    const std::size_t size = out.size(), even = (size + 1) / 2;
    for (std::size_t i = 1; i < size; ++i)
        from[i] = static_cast<std::uint8_t>(from[i - 1] + from[i] - 128);
    for (std::size_t i = 0; i < size; ++i)
        out[i] = filtered[i % 2 == 0 ? i / 2 : even + i / 2];
}

}  // namespace

std::uint64_t exrMostUnpacked(const std::string& compression, std::uint64_t packed) {
    constexpr std::uint64_t kZlib = 1100;  // it cannot beat 1032:1; some room
    constexpr std::uint64_t kRuns = 64;    // 128 bytes from two
    if (compression == "none") return packed;
    if (compression == "rle") return packed * kRuns;
    return compression == "zips" || compression == "zip" ? packed * kZlib : 0;
}

bool exrUnpack(const std::string& compression, std::span<const std::byte> packed,
               std::span<std::byte> out) {
    if (packed.size() == out.size()) {  // what does not shrink is stored as it is
        if (!out.empty()) std::memcpy(out.data(), packed.data(), out.size());
        return true;
    }
    return packed.size() < out.size() && exrUnpackAlways(compression, packed, out);
}

bool exrUnpackAlways(const std::string& compression, std::span<const std::byte> packed,
                     std::span<std::byte> out) {
    if (compression == "none") return false;
    std::vector<std::byte> filtered(out.size());
    if (!(compression == "rle" ? unpackRuns(packed, filtered) : inflate(packed, filtered)))
        return false;
    unfilter(filtered, out);
    return true;
}

}  // namespace peeler
