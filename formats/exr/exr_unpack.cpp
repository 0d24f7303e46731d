// SPDX-License-Identifier: Apache-2.0
// Unpacking of chunks: zlib or run lengths, then running sums of the differences, then interleaving
// of even and odd bytes.
#include "formats/exr/exr_chunks.h"

#include <libdeflate.h>

#include <algorithm>
#include <cstring>
#include <memory>

#include "formats/exr/exr_layout.h"

namespace peeler {
namespace {

/// The inverse of packRuns() in exr_chunks.cpp.
bool unpackRuns(std::span<const std::byte> packed, std::span<std::byte> out) {
    std::size_t filled = 0;
    for (std::size_t i = 0; i < packed.size();) {
        // The code is a signed byte: values from 128 mean code − 256.
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

/// Replaces differences, biased by 128, with their running sums, starting from `last`. Returns the
/// last sum.
///
/// Handles eight bytes at once: spreads even and odd bytes over 16-bit lanes. A multiplication by a
/// word of four ones gives the running sums of the lanes, which stay below 2^16.
std::uint8_t addUp(std::span<std::uint8_t> bytes, std::uint8_t last) {
    constexpr std::uint64_t kEven = 0x00ff00ff00ff00ff, kOnes = 0x0001000100010001;
    constexpr std::uint64_t kBias = 0x8080808080808080;
    std::size_t i = 0;
    for (; i + sizeof(std::uint64_t) <= bytes.size(); i += sizeof(std::uint64_t)) {
        std::uint64_t word = 0;
        std::memcpy(&word, bytes.data() + i, sizeof word);
        word ^= kBias;  // subtracts 128 from each byte, modulo 256
        const std::uint64_t even = (word & kEven) * kOnes, odd = (word >> 8U & kEven) * kOnes;
        const std::uint64_t before = last * kOnes;
        const std::uint64_t at_even = even + (odd << 16U) + before, at_odd = even + odd + before;
        word = (at_even & kEven) | (at_odd & kEven) << 8U;
        std::memcpy(bytes.data() + i, &word, sizeof word);
        last = static_cast<std::uint8_t>(last + ((even + odd) >> 48U));
    }
    for (; i < bytes.size(); ++i)
        bytes[i] = last = static_cast<std::uint8_t>(last + bytes[i] - 128);
    return last;
}

/// The inverse of ExrChunkPacker::filter(). Destroys `filtered`.
void unfilter(std::span<std::uint8_t> filtered, std::span<std::byte> out) {
    addUp(filtered, 128);  // the first byte is not a difference and has no bias
    const std::size_t size = out.size(), half = size / 2;
    const std::uint8_t* const even = filtered.data();
    const std::uint8_t* const odd = even + (size - half);
    auto* const to = reinterpret_cast<std::uint8_t*>(out.data());
    for (std::size_t i = 0; i < half; ++i) {
        to[2 * i] = even[i];
        to[2 * i + 1] = odd[i];
    }
    if (size % 2 != 0) to[size - 1] = even[half];
}

}  // namespace

bool exrInflate(std::span<const std::byte> packed, std::span<std::byte> out) {
    // The decompressor is kept between calls: creating one takes longer than unpacking the few
    // bytes of a deep row.
    thread_local const std::unique_ptr<libdeflate_decompressor, void (*)(libdeflate_decompressor*)>
        inflater(libdeflate_alloc_decompressor(), libdeflate_free_decompressor);
    // With a null pointer for the actual size, libdeflate requires the result to fill `out`
    // exactly.
    return inflater &&
           libdeflate_zlib_decompress(inflater.get(), packed.data(), packed.size(), out.data(),
                                      out.size(), nullptr) == LIBDEFLATE_SUCCESS;
}

std::uint64_t exrMostUnpacked(const std::string& compression, std::uint64_t packed) {
    constexpr std::uint64_t kRuns = 64;  // two bytes unpack to at most 128
    if (compression == "none") return packed;
    if (compression == "rle") return packed * kRuns;
    return compression == "zips" || compression == "zip" ? packed * kMostZlibRatio : 0;
}

bool exrUnpack(const std::string& compression, std::span<const std::byte> packed,
               std::span<std::byte> out) {
    if (packed.size() == out.size()) {  // data that does not compress is stored raw
        if (!out.empty()) std::memcpy(out.data(), packed.data(), out.size());
        return true;
    }
    return packed.size() < out.size() && exrUnpackAlways(compression, packed, out);
}

bool exrUnpackAlways(const std::string& compression, std::span<const std::byte> packed,
                     std::span<std::byte> out) {
    if (compression == "none") return false;
    const auto storage = std::make_unique_for_overwrite<std::uint8_t[]>(out.size());
    const std::span<std::uint8_t> filtered(storage.get(), out.size());
    const auto bytes = std::as_writable_bytes(filtered);
    if (!(compression == "rle" ? unpackRuns(packed, bytes) : exrInflate(packed, bytes)))
        return false;
    unfilter(filtered, out);
    return true;
}

}  // namespace peeler
