// SPDX-License-Identifier: Apache-2.0
// Tests that KTX 2.0 files are decoded as specified, that all fields are checked, and that every
// error names the byte.
#include <gtest/gtest.h>
#include <libdeflate.h>
#include <zstd.h>

#include <memory>
#include <stdexcept>

#include "formats/image/basis_builder.h"
#include "formats/image/image_codecs.h"
#include "formats/image/ktx2_builder.h"
#include "formats/image/uastc_builder.h"

namespace peeler::test {
namespace {

struct Picture {
    StoredImage stored;
    Bytes rgba;
};

Picture decoded(const Bytes& file) {
    const auto decoder = ktx2Decoder("", file);
    Picture out{decoder->image(), {}};
    out.rgba.resize(static_cast<std::size_t>(out.stored.width * out.stored.height) * 4);
    decoder->read(0, 4, out.rgba.data());
    return out;
}

std::string problemOf(const Bytes& file) {
    try {
        decoded(file);
    } catch (const std::runtime_error& problem) {
        return problem.what();
    }
    ADD_FAILURE() << "nothing was wrong";
    return "";
}

/// Returns the two blocks of 8 × 4 pixels. Each is of a single colour.
Bytes twoBlocks() {
    Bytes blocks = solidUastcBlock(10, 20, 30, 40);
    const Bytes second = solidUastcBlock(50, 60, 70, 80);
    blocks.insert(blocks.end(), second.begin(), second.end());
    return blocks;
}

Bytes zstandard(const Bytes& bytes) {
    Bytes out(ZSTD_compressBound(bytes.size()));
    out.resize(ZSTD_compress(out.data(), out.size(), bytes.data(), bytes.size(), 3));
    return out;
}

Bytes zlib(const Bytes& bytes) {
    const std::unique_ptr<libdeflate_compressor, decltype(&libdeflate_free_compressor)> compressor(
        libdeflate_alloc_compressor(6), libdeflate_free_compressor);
    Bytes out(libdeflate_zlib_compress_bound(compressor.get(), bytes.size()));
    out.resize(libdeflate_zlib_compress(compressor.get(), bytes.data(), bytes.size(), out.data(),
                                        out.size()));
    return out;
}

TEST(Ktx2, IsDecodedToRgba) {
    const Picture picture = decoded(uastcFile(8, 4, twoBlocks()).bytes());
    EXPECT_EQ(picture.stored.width, 8);
    EXPECT_EQ(picture.stored.height, 4);
    EXPECT_EQ(picture.stored.channels, (std::vector<std::string>{"R", "G", "B", "A"}));
    EXPECT_TRUE(picture.stored.straight_alpha);
    EXPECT_EQ(picture.stored.codec, "KTX2, UASTC");
    EXPECT_EQ(picture.stored.srgb, true);
    EXPECT_TRUE(picture.stored.notes.empty());
    for (std::size_t i = 0; i < picture.rgba.size(); ++i)
        EXPECT_EQ(picture.rgba[i], (i / 16 % 2 == 0 ? 10 : 50) + 10 * (i % 4)) << i;
}

TEST(Ktx2, GivesSomeChannelsAndFloats) {
    const Bytes file = uastcFile(4, 4, solidUastcBlock(51, 102, 153, 204)).bytes();
    const auto decoder = ktx2Decoder("", file);
    std::vector<float> green_blue(32);
    decoder->read(1, 3, green_blue.data());
    EXPECT_FLOAT_EQ(green_blue[0], 0.4F);
    EXPECT_FLOAT_EQ(green_blue[31], 0.6F);
}

TEST(Ktx2, IsUnpacked) {
    const Bytes blocks = twoBlocks();
    Ktx2File file = uastcFile(8, 4, blocks);
    const Bytes expected = decoded(file.bytes()).rgba;
    for (const auto& [scheme, packed, name] :
         {std::tuple(2U, zstandard(blocks), "KTX2, UASTC, Zstandard"),
          std::tuple(3U, zlib(blocks), "KTX2, UASTC, ZLIB")}) {
        file.scheme = scheme;
        file.levels = {{packed, blocks.size()}};
        const Picture picture = decoded(file.bytes());
        EXPECT_EQ(picture.rgba, expected) << name;
        EXPECT_EQ(picture.stored.codec, name);
        // The data is truncated, damaged, or not as long as declared.
        file.levels[0].bytes.pop_back();
        EXPECT_TRUE(contains(problemOf(file.bytes()), scheme == 2 ? "Zstandard: " : "ZLIB"));
        file.levels[0].bytes = Bytes(packed.size(), 0x55);
        EXPECT_TRUE(contains(problemOf(file.bytes()), scheme == 2 ? "no Zstandard frame" : "ZLIB"));
        Bytes longer = blocks;
        longer.resize(48);
        file.levels[0].bytes = scheme == 2 ? zstandard(longer) : zlib(longer);
        EXPECT_TRUE(contains(problemOf(file.bytes()), scheme == 2 ? "Zstandard" : "ZLIB"));
        longer.resize(16);
        file.levels[0].bytes = scheme == 2 ? zstandard(longer) : zlib(longer);
        EXPECT_TRUE(contains(problemOf(file.bytes()), scheme == 2 ? "Zstandard" : "ZLIB"));
    }
}

TEST(Ktx2, MayHaveSeveralFramesOfZstandardAndNothingElse) {
    const Bytes blocks = twoBlocks();
    Bytes frames = zstandard(Bytes(blocks.begin(), blocks.begin() + 16));
    const Bytes second = zstandard(Bytes(blocks.begin() + 16, blocks.end()));
    const std::size_t at = frames.size();
    frames.insert(frames.end(), second.begin(), second.end());
    Ktx2File file = uastcFile(8, 4, blocks);
    file.scheme = 2;
    file.levels[0].bytes = frames;
    EXPECT_EQ(decoded(file.bytes()).rgba, decoded(uastcFile(8, 4, blocks).bytes()).rgba);
    file.levels[0].bytes[at] = 0x27;  // the magic number of Zstandard 0.7
    EXPECT_TRUE(contains(problemOf(file.bytes()), "no Zstandard frame begins here"));
}

TEST(Ktx2, OfBasisLzIsDecoded) {
    BasisBooks books;
    books.endpoints = {{16, 8, 24, 0}, {31, 31, 31, 0}};
    const Ktx2File file =
        basisFile(4, 4, books, {plainSlice(books, 1, {{0, 0}}), plainSlice(books, 1, {{1, 0}})});
    const Picture picture = decoded(file.bytes());
    EXPECT_EQ(picture.stored.codec, "KTX2, ETC1S, BasisLZ");
    EXPECT_EQ(Bytes(picture.rgba.begin(), picture.rgba.begin() + 4), (Bytes{124, 58, 190, 247}));
}

TEST(Ktx2, MayHavePlainBytes) {
    const Bytes samples = {1, 2, 3, 4, 5, 6, 7, 8, 9, 10, 11, 12};
    Ktx2File file;
    file.model = 1;
    file.width = 4;
    file.height = 1;
    file.channels = {0, 1, 2};
    file.levels = {{samples, samples.size()}};
    for (const std::uint32_t format : {23U, 29U}) {
        file.vk_format = format;
        file.transfer = format == 23 ? 1 : 2;
        const Picture picture = decoded(file.bytes());
        EXPECT_EQ(picture.rgba, (Bytes{1, 2, 3, 255, 4, 5, 6, 255, 7, 8, 9, 255, 10, 11, 12, 255}));
        EXPECT_EQ(picture.stored.codec, "KTX2, RGB8");
        EXPECT_EQ(picture.stored.srgb, format == 29);
    }
    file.transfer = 1;
    EXPECT_TRUE(contains(problemOf(file.bytes()), "its transfer function is not"));
    file.width = 3;
    file.channels = {0, 1, 2, 15};
    file.vk_format = 37;
    EXPECT_EQ(decoded(file.bytes()).rgba, samples);
    EXPECT_EQ(decoded(file.bytes()).stored.codec, "KTX2, RGBA8");
    file.channels = {2, 1, 0, 15};
    EXPECT_TRUE(contains(problemOf(file.bytes()), "not those of RGBA8"));
    file.channels = {0, 1, 2};
    EXPECT_TRUE(contains(problemOf(file.bytes()), "not those of RGBA8"));
}

TEST(Ktx2, HasTheChannelsThatItSays) {
    const auto shown = [](std::uint8_t channel) {
        Ktx2File file = uastcFile(4, 4, solidUastcBlock(1, 2, 3, 4));
        file.channels = {channel};
        const Bytes rgba = decoded(file.bytes()).rgba;
        return Bytes(rgba.begin(), rgba.begin() + 4);
    };
    EXPECT_EQ(shown(0), (Bytes{1, 2, 3, 255}));  // RGB
    EXPECT_EQ(shown(3), (Bytes{1, 2, 3, 4}));    // RGBA
    // This channel means repeated R, but a beta of toktx wrote it into colour files.
    EXPECT_EQ(shown(4), (Bytes{1, 2, 3, 255}));
    EXPECT_EQ(shown(5), (Bytes{1, 4, 0, 255}));  // repeated R, with G as alpha
    EXPECT_EQ(shown(6), (Bytes{1, 2, 0, 255}));  // R and G
    EXPECT_TRUE(contains(problemOf([] {
                             Ktx2File file = uastcFile(4, 4, solidUastcBlock(1, 2, 3, 4));
                             file.channels = {7};
                             return file.bytes();
                         }()),
                         "the channels are not those of UASTC"));
    BasisBooks books;
    books.endpoints = {{16, 8, 24, 0}, {31, 31, 31, 0}};
    Ktx2File file =
        basisFile(4, 4, books, {plainSlice(books, 1, {{0, 0}}), plainSlice(books, 1, {{1, 0}})});
    Ktx2File grey = basisFile(4, 4, books, {plainSlice(books, 1, {{0, 0}})});
    grey.channels = {3};
    const Bytes all_three = decoded(grey.bytes()).rgba;
    grey.channels = {0};
    EXPECT_EQ(all_three, decoded(grey.bytes()).rgba);
    file.channels = {3, 4};  // one slice has red, the other green
    const Bytes rgba = decoded(file.bytes()).rgba;
    EXPECT_EQ(Bytes(rgba.begin(), rgba.begin() + 4), (Bytes{124, 247, 0, 255}));
}

TEST(Ktx2, HasItsMetadata) {
    Ktx2File file = uastcFile(4, 4, solidUastcBlock(1, 2, 3, 4));
    using std::string_literals::operator""s;
    file.metadata = {{"KTXorientation", "rd\0"s}, {"KTXswizzle", "rgba\0"s}, {"KTXwriter", "x"}};
    EXPECT_TRUE(decoded(file.bytes()).stored.notes.empty());
    file.metadata = {{"KTXorientation", "ru\0"s}};
    const Picture turned = decoded(file.bytes());
    ASSERT_EQ(turned.stored.notes.size(), 1U);
    EXPECT_TRUE(contains(turned.stored.notes[0], "KTXorientation"));
    file.metadata = {{"KTXswizzle", "b0a1"}};
    const Picture swizzled = decoded(file.bytes());
    EXPECT_EQ(Bytes(swizzled.rgba.begin(), swizzled.rgba.begin() + 4), (Bytes{3, 0, 4, 255}));
    ASSERT_EQ(swizzled.stored.notes.size(), 1U);
    EXPECT_TRUE(contains(swizzled.stored.notes[0], "b0a1"));
    // If the texture has no alpha, `a` is 1.
    file.channels = {0};
    file.metadata = {{"KTXswizzle", "aaar"}};
    const Bytes white = decoded(file.bytes()).rgba;
    EXPECT_EQ(Bytes(white.begin(), white.begin() + 4), (Bytes{255, 255, 255, 1}));
    file.metadata = {{"KTXswizzle", "rgb"}};
    EXPECT_TRUE(contains(problemOf(file.bytes()), "KTXswizzle is invalid"));
    file.metadata = {{"", "x"}};
    EXPECT_TRUE(contains(problemOf(file.bytes()), "key is empty"));
    file.metadata = {{"abcd", "efg"}};
    Bytes bytes = file.bytes();
    const std::size_t pairs = file.descriptorAt() + 44;
    setNumber(bytes, pairs + 8, 0x65656565);
    EXPECT_TRUE(contains(problemOf(bytes), "does not end"));
    for (const std::uint32_t size : {0U, 1U, 9U, 0xFFFFFFFFU}) {
        setNumber(bytes, pairs, size);
        EXPECT_TRUE(contains(problemOf(bytes), "a key/value pair has an invalid length"));
    }
}

TEST(Ktx2, NotesWhatTheExtensionForbidsAndDoesNotMatter) {
    Ktx2File file = uastcFile(3, 4, solidUastcBlock(1, 2, 3, 4));
    ASSERT_EQ(decoded(file.bytes()).stored.notes.size(), 1U);
    EXPECT_TRUE(contains(decoded(file.bytes()).stored.notes[0], "not multiples of 4"));
    EXPECT_EQ(decoded(file.bytes()).rgba.size(), 48U);
    file.width = 4;
    file.primaries = 10;
    EXPECT_TRUE(contains(decoded(file.bytes()).stored.notes.at(0), "primaries"));
    file.primaries = 0;
    file.transfer = 1;
    EXPECT_EQ(decoded(file.bytes()).stored.srgb, false);
    file.transfer = 0;
    EXPECT_EQ(decoded(file.bytes()).stored.srgb, std::nullopt);
    EXPECT_TRUE(decoded(file.bytes()).stored.notes.empty());
    file.transfer = 7;
    EXPECT_TRUE(contains(decoded(file.bytes()).stored.notes.at(0), "transfer function"));
}

TEST(Ktx2, MayHaveLevelsThatAreChecked) {
    Ktx2File file;
    file.width = 8;
    file.height = 4;
    const Bytes small = solidUastcBlock(1, 1, 1, 1);
    file.levels = {{twoBlocks(), 32}, {small, 16}, {small, 16}, {small, 16}};
    EXPECT_EQ(decoded(file.bytes()).rgba[0], 10);
    file.levels[3].bytes.pop_back();
    EXPECT_TRUE(contains(problemOf(file.bytes()), "a level of 1 x 1 pixels needs 16 bytes"));
    file.levels[3] = {small, 16};
    file.levels.push_back({small, 16});
    EXPECT_TRUE(contains(problemOf(file.bytes()), "cannot have 5 levels"));
    file.levels.resize(4);
    file.levels[2].unpacked = 32;
    EXPECT_TRUE(contains(problemOf(file.bytes()), "needs 16 bytes, but has 32"));
}

/// A header field and an invalid value.
struct Damage {
    const char* name;
    std::size_t at;
    std::uint64_t value;
    std::size_t size;
    const char* words;
};

class DamagedKtx2 : public testing::TestWithParam<Damage> {};

TEST_P(DamagedKtx2, IsRefused) {
    const Ktx2File file = uastcFile(8, 4, twoBlocks());
    Bytes bytes = file.bytes();
    setNumber(bytes, GetParam().at, GetParam().value, GetParam().size);
    const std::string problem = problemOf(bytes);
    EXPECT_TRUE(contains(problem, GetParam().words)) << problem;
    EXPECT_TRUE(contains(problem, "(KTX2, byte ")) << problem;
}

constexpr std::size_t kDescriptor = 80 + 24, kBlock = kDescriptor + 4;
INSTANTIATE_TEST_SUITE_P(
    All, DamagedKtx2,
    testing::Values(
        Damage{"Identifier", 5, '1', 1, "KTX 2.0 header is missing"},
        Damage{"VkFormat", 12, 98, 4, "VkFormat 98 with the colour model 166"},
        Damage{"TypeSize", 16, 2, 4, "are not bytes"},
        Damage{"NoWidth", 20, 0, 4, "a side has 0 pixels"},
        Damage{"EndlessWidth", 20, 0xFFFFFFFF, 4, "4294967295 pixels"},
        Damage{"EndlessHeight", 24, 0x10000000, 4, "268435456 pixels"},
        Damage{"NoHeight", 24, 0, 4, "a 1D texture"}, Damage{"Depth", 28, 4, 4, "a 3D texture"},
        Damage{"Layers", 32, 1, 4, "an array of textures"}, Damage{"Faces", 36, 6, 4, "a cube map"},
        Damage{"NoFaces", 36, 0, 4, "a cube map"},
        Damage{"NoLevels", 40, 0, 4, "cannot have 0 levels"},
        Damage{"ManyLevels", 40, 0xFFFFFFFF, 4, "cannot have 4294967295 levels"},
        Damage{"LevelsNotThere", 20, 1U << 24U, 4, "a level of 16777216 x 4 pixels"},
        Damage{"Scheme", 44, 4, 4, "scheme 4 is not known"},
        Damage{"VendorScheme", 44, 0x10000, 4, "scheme 65536 is not known"},
        Damage{"BasisLzOfUastc", 44, 1, 4, "BasisLZ and ETC1S"},
        Damage{"DescriptorOutside", 48, 0xFFFFFF00, 4, "the data format descriptor of 44 bytes"},
        Damage{"DescriptorShort", 52, 43, 4, "descriptor is too short"},
        Damage{"DescriptorLong", 52, 48, 4, "says that it has 44 bytes, but the index says 48"},
        Damage{"MetadataOutside", 60, 0xFFFFFFFF, 4, "the key/value data of 4294967295 bytes"},
        Damage{"LevelOutside", 80, ~std::uint64_t{0}, 8, "the level of 32 bytes"},
        Damage{"LevelEndless", 88, ~std::uint64_t{0}, 8, "the level of 18446744073709551615"},
        Damage{"LevelShort", 88, 31, 8, "stored as 31"},
        Damage{"LevelOfOthers", 96, 31, 8, "needs 32 bytes, but has 31"},
        Damage{"Vendor", kBlock, 1, 1, "begin with a basic block"},
        Damage{"BlockSize", kBlock + 6, 41, 2, "begin with a basic block"},
        Damage{"BlockSizeLarge", kBlock + 6, 56, 2, "begin with a basic block"},
        Damage{"BlockSizeSmall", kBlock + 6, 24, 2, "begin with a basic block"},
        Damage{"Model", kBlock + 8, 160, 1, "the colour model 160"},
        Damage{"Etc1sUnpacked", kBlock + 8, 163, 1, "BasisLZ and ETC1S"},
        Damage{"Premultiplied", kBlock + 11, 1, 1, "multiplied by alpha"},
        Damage{"BlockSide", kBlock + 12, 7, 1, "another size than those of UASTC"}),
    [](const auto& test) { return std::string(test.param.name); });

TEST(Ktx2, IsRefusedWhereverItEnds) {
    const Bytes whole = uastcFile(8, 4, twoBlocks()).bytes();
    for (std::size_t size = 0; size < whole.size(); ++size) {
        const Bytes cut(whole.begin(), whole.begin() + static_cast<std::ptrdiff_t>(size));
        EXPECT_TRUE(contains(problemOf(cut), "KTX2, byte")) << size;
    }
}

TEST(Ktx2, PromisesNoMoreThanItsPackingCan) {
    // 16,384 pixels per side are 268,435,456 bytes. 8,191 bytes of Zstandard can expand to at most
    // 268,402,688, so they are rejected at once. 8,192 bytes could suffice, so the check passes,
    // but they do not contain the pixels.
    Ktx2File file = uastcFile(16384, 16384, {});
    for (const auto& [scheme, most] : {std::pair(2U, 8192U), std::pair(3U, 260112U)}) {
        file.scheme = scheme;
        file.levels = {{Bytes(most - 1), 268435456}};
        const Bytes few = file.bytes();
        EXPECT_THROW(ktx2Decoder("", few), std::runtime_error);
        file.levels = {{Bytes(most), 268435456}};
        const Bytes enough = file.bytes();
        EXPECT_NO_THROW(ktx2Decoder("", enough));
    }
}

TEST(Ktx2, NeverEndsOtherwiseThanInAPictureOrAnError) {
    BasisBooks books;
    books.endpoints = {{16, 8, 24, 0}, {31, 31, 31, 0}, {1, 2, 3, 4}};
    books.selectors = {0x12345678, 0x9ABCDEF0};
    books.history = 5;
    const std::vector<BasisBlock> blocks = {{0, 0}, {1, 1}, {2, 0}, {0, 3}, {1, 1}, {2, 2}};
    const Bytes slice = plainSlice(books, 3, blocks);
    Ktx2File packed = uastcFile(8, 4, twoBlocks());
    packed.scheme = 2;
    packed.levels = {{zstandard(twoBlocks()), 32}};
    packed.metadata = {{"KTXswizzle", "bgra"}};
    const std::vector<Bytes> files = {uastcFile(8, 4, twoBlocks()).bytes(), packed.bytes(),
                                      basisFile(12, 8, books, {slice, slice}).bytes()};
    unsigned state = 1;
    const auto random = [&] { return state = state * 1664525U + 1013904223U, state >> 8U; };
    for (const Bytes& file : files)
        for (int round = 0; round < 3000; ++round) {
            Bytes damaged = file;
            for (int i = 0; i < 2; ++i)
                damaged[random() % damaged.size()] = static_cast<std::uint8_t>(random());
            try {
                const auto decoder = ktx2Decoder("", damaged);
                const StoredImage& stored = decoder->image();
                if (stored.width > 256 || stored.height > 256) continue;
                std::vector<std::uint8_t> rgba(
                    static_cast<std::size_t>(stored.width * stored.height) * 4);
                decoder->read(0, 4, rgba.data());
            } catch (const std::runtime_error& problem) {
                EXPECT_TRUE(contains(problem.what(), "KTX2, byte")) << problem.what();
            }
        }
}

}  // namespace
}  // namespace peeler::test
