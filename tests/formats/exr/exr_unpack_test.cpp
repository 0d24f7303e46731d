// SPDX-License-Identifier: Apache-2.0
// Tests packing and unpacking of chunks of every small size. The unpacker adds words of 8 bytes,
// and the remaining bytes separately.
#include "formats/exr/exr_chunks.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <random>
#include <string>
#include <utility>
#include <vector>

namespace peeler {
namespace {

/// Returns two-byte pixels. Each of the two bytes increases slowly or jumps, and wraps at 256.
std::vector<std::byte> slowPixels(std::size_t size, std::mt19937& random) {
    std::vector<std::byte> bytes(size);
    for (std::size_t i = 0; i < size; ++i) {
        const std::size_t step = random() % 16U == 0 ? 200 : random() % 2U;
        const std::size_t before = i < 2 ? 250 : std::to_integer<std::size_t>(bytes[i - 2]);
        bytes[i] = static_cast<std::byte>(before + step);
    }
    return bytes;
}

TEST(ExrUnpack, GivesBackChunksOfEverySize) {
    constexpr std::pair<Imf::Compression, const char*> kCompressions[] = {
        {Imf::ZIP_COMPRESSION, "zip"},
        {Imf::ZIPS_COMPRESSION, "zips"},
        {Imf::RLE_COMPRESSION, "rle"}};
    std::mt19937 random(5);
    for (const auto& [compression, name] : kCompressions) {
        ExrChunkPacker packer(4, compression);
        ByteBuffer packed;
        int smaller = 0;
        for (std::size_t size = 0; size < 300; ++size) {
            const std::vector<std::byte> pixels = slowPixels(size, random);
            std::ranges::copy(pixels, packer.raw(size).begin());
            packer.pack(packed);
            smaller += packed.size() < size ? 1 : 0;
            std::vector<std::byte> back(size, std::byte{0x5a});
            ASSERT_TRUE(exrUnpack(name, packed, back)) << name << " " << size;
            ASSERT_EQ(back, pixels) << name << " " << size;
        }
        if (compression != Imf::RLE_COMPRESSION) {
            EXPECT_GT(smaller, 200);
        }
    }
}

/// A packer reuses its buffers for smaller and larger chunks.
TEST(ExrUnpack, PackersForgetTheChunkBefore) {
    std::mt19937 random(6);
    ExrChunkPacker packer(4);
    ByteBuffer packed;
    for (const std::size_t size : {5000U, 70U, 9000U, 200U, 5000U}) {
        const std::vector<std::byte> pixels = slowPixels(size, random);
        std::ranges::copy(pixels, packer.raw(size).begin());
        packer.pack(packed);
        std::vector<std::byte> back(size);
        ASSERT_TRUE(exrUnpack("zip", packed, back)) << size;
        ASSERT_EQ(back, pixels) << size;
    }
}

}  // namespace
}  // namespace peeler
