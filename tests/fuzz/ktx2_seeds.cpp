// SPDX-License-Identifier: Apache-2.0
// KTX 2.0 seeds for all texel formats and supercompressions.
#include <libdeflate.h>
#include <zstd.h>

#include <memory>

#include "formats/image/basis_builder.h"
#include "formats/image/ktx2_builder.h"
#include "formats/image/uastc_builder.h"
#include "fuzz/seeds.h"

namespace peeler::fuzz {
namespace {

/// Returns blocks in every mode, with low values in all fields.
SeedBytes blocksOfAllModes() {
    SeedBytes blocks;
    for (std::size_t mode = 0; mode < std::size(test::kUastcLayouts); ++mode) {
        const test::UastcLayout& layout = test::kUastcLayouts[mode];
        test::UastcFields fields;
        fields.mode = mode;
        fields.endpoints.assign(layout.endpoints(), 1);
        fields.weights.assign(std::size_t{16} * layout.planes, 0);
        const SeedBytes block =
            layout.subsets == 0 ? test::solidUastcBlock(1, 2, 3, 4) : test::uastcBlock(fields);
        blocks.insert(blocks.end(), block.begin(), block.end());
    }
    return blocks;
}

SeedBytes packed(std::uint32_t scheme, const SeedBytes& bytes) {
    SeedBytes out;
    if (scheme == 2) {
        out.resize(ZSTD_compressBound(bytes.size()));
        out.resize(ZSTD_compress(out.data(), out.size(), bytes.data(), bytes.size(), 3));
        return out;
    }
    const std::unique_ptr<libdeflate_compressor, decltype(&libdeflate_free_compressor)> compressor(
        libdeflate_alloc_compressor(6), libdeflate_free_compressor);
    out.resize(libdeflate_zlib_compress_bound(compressor.get(), bytes.size()));
    out.resize(libdeflate_zlib_compress(compressor.get(), bytes.data(), bytes.size(), out.data(),
                                        out.size()));
    return out;
}

/// Returns a Basis stream with runs of predictions and selectors, and with a history.
SeedBytes basisOfRuns() {
    test::BasisBooks books;
    books.endpoints = {{16, 8, 24, 0}, {1, 2, 3, 7}, {31, 31, 31, 2}};
    books.selectors = {0x12345678, 0x9ABCDEF0};
    books.history = 3;
    test::BitWriter bits;
    books.predictions.put(bits, 0xFF);
    for (const std::size_t delta : {1U, 2U}) {
        books.deltas().put(bits, delta);
        books.codes().put(bits, 1);
    }
    books.predictions.put(bits, 256);
    bits.put(0, 5);
    books.deltas().put(bits, 1);
    books.codes().put(bits, 5);
    books.runs.put(bits, 63);
    bits.put(3, 8);
    for (int i = 0; i < 5; ++i)
        books.deltas().put(bits, 1);
    return test::basisFile(32, 4, books, {bits.bytes()}).bytes();
}

}  // namespace

void addKtx2Seeds(Seeds& seeds) {
    std::vector<SeedBytes>& out = seeds["ktx2"];
    const SeedBytes blocks = blocksOfAllModes();
    const auto width = static_cast<std::uint32_t>(blocks.size() / 4);
    test::Ktx2File uastc = test::uastcFile(width, 4, blocks);
    uastc.metadata = {{"KTXorientation", "rd"}, {"KTXswizzle", "rgb1"}};
    out.push_back(uastc.bytes());
    for (const std::uint32_t scheme : {2U, 3U}) {
        uastc.scheme = scheme;
        uastc.levels = {{packed(scheme, blocks), blocks.size()}};
        out.push_back(uastc.bytes());
    }

    test::Ktx2File plain;
    plain.model = 1;
    plain.vk_format = 43;
    plain.channels = {0, 1, 2, 15};
    plain.levels = {{SeedBytes(64, 7), 64}, {SeedBytes(16, 8), 16}, {SeedBytes(4, 9), 4}};
    out.push_back(plain.bytes());

    test::BasisBooks books;
    books.endpoints = {{16, 8, 24, 0}, {1, 2, 3, 7}};
    books.selectors = {0x12345678, 0x9ABCDEF0};
    books.history = 2;
    for (const bool grey : {false, true}) {
        books.grey = books.plain = grey;
        const SeedBytes slice =
            test::plainSlice(books, 2, {{0, 0}, {1, 1}, {0, 1}, {1, 0}, {1, 1}, {0, 0}});
        out.push_back(test::basisFile(8, 12, books, {slice}).bytes());
        out.push_back(test::basisFile(8, 12, books, {slice, slice}).bytes());
    }
    out.push_back(basisOfRuns());
}

}  // namespace peeler::fuzz
