// SPDX-License-Identifier: Apache-2.0
// Mutates bytes, then repairs the checksums of a PNG or ZIP. Readers would reject nearly all inputs
// with wrong checksums.
#include <libdeflate.h>

#include "fuzz/fuzz_target.h"

extern "C" std::size_t LLVMFuzzerMutate(std::uint8_t* data, std::size_t size, std::size_t most);
extern "C" std::size_t LLVMFuzzerCustomMutator(std::uint8_t* data, std::size_t size,
                                               std::size_t most, unsigned seed);

namespace peeler::fuzz {
namespace {

using Bytes = std::span<std::uint8_t>;

std::uint32_t bigEndianAt(Bytes bytes, std::size_t at) {
    std::uint32_t value = 0;
    for (std::size_t i = 0; i < 4; ++i)
        value = value << 8U | bytes[at + i];
    return value;
}

template <class T>
T littleEndianAt(Bytes bytes, std::size_t at) {
    T value{};
    if (at <= bytes.size() && sizeof value <= bytes.size() - at)
        std::memcpy(&value, bytes.data() + at, sizeof value);
    return value;
}

bool beginsWith(Bytes bytes, std::string_view text) {
    return bytes.size() >= text.size() && std::memcmp(bytes.data(), text.data(), text.size()) == 0;
}

void repairPng(Bytes bytes) {
    constexpr std::size_t kSignature = 8, kFrame = 12;
    for (std::size_t at = kSignature; at + kFrame <= bytes.size();) {
        const std::size_t length = bigEndianAt(bytes, at);
        if (length > bytes.size() - at - kFrame) return;
        const std::uint32_t crc = libdeflate_crc32(0, bytes.data() + at + 4, length + 4);
        for (std::size_t i = 0; i < 4; ++i)
            bytes[at + 8 + length + i] = static_cast<std::uint8_t>(crc >> (24 - 8 * i));
        at += kFrame + length;
    }
}

/// Repairs the checksums of uncompressed members, found through the central directory.
void repairZip(Bytes bytes) {
    constexpr std::size_t kEntry = 46, kLocal = 30;
    for (std::size_t at = 0; at + kEntry <= bytes.size(); ++at) {
        if (littleEndianAt<std::uint32_t>(bytes, at) != 0x02014B50U) continue;
        std::uint64_t size = littleEndianAt<std::uint32_t>(bytes, at + 24);
        const std::size_t local = littleEndianAt<std::uint32_t>(bytes, at + 42);
        const std::size_t begin = local + kLocal +
                                  littleEndianAt<std::uint16_t>(bytes, local + 26) +
                                  littleEndianAt<std::uint16_t>(bytes, local + 28);
        // In ZIP64 files of peeler, the extra field begins with the size.
        if (size == 0xFFFFFFFFU)
            size = littleEndianAt<std::uint64_t>(
                bytes, at + kEntry + littleEndianAt<std::uint16_t>(bytes, at + 28) + 4);
        if (littleEndianAt<std::uint16_t>(bytes, at + 10) != 0 || begin > bytes.size() ||
            size > bytes.size() - begin)
            continue;
        const std::uint32_t crc = libdeflate_crc32(0, bytes.data() + begin, size);
        std::memcpy(bytes.data() + at + 16, &crc, sizeof crc);
    }
}

}  // namespace
}  // namespace peeler::fuzz

std::size_t LLVMFuzzerCustomMutator(std::uint8_t* data, std::size_t size, std::size_t most,
                                    unsigned seed) {
    size = LLVMFuzzerMutate(data, size, most);
    const peeler::fuzz::Bytes bytes(data, size);
    if (seed % 16 == 0) return size;
    if (peeler::fuzz::beginsWith(bytes, "\x89PNG")) peeler::fuzz::repairPng(bytes);
    if (peeler::fuzz::beginsWith(bytes, "PK")) peeler::fuzz::repairZip(bytes);
    return size;
}
