// SPDX-License-Identifier: Apache-2.0
// Tests that BasisLZ decodes to the original ETC1S texels with every kind of encoding, and that
// damage is rejected.
#include <gtest/gtest.h>

#include <functional>
#include <stdexcept>

#include "formats/image/basis_builder.h"
#include "formats/image/basis_lz.h"

namespace peeler::test {
namespace {

using Color = std::array<std::uint8_t, 4>;

std::vector<Color> pixelsOf(const Ktx2File& file) {
    const Bytes bytes = file.bytes();
    std::vector<std::uint8_t> rgba(std::size_t{4} * file.width * file.height);
    decodeEtc1s(readKtx2(bytes), rgba.data());
    std::vector<Color> pixels(rgba.size() / 4);
    for (std::size_t i = 0; i < rgba.size(); ++i)
        pixels[i / 4][i % 4] = rgba[i];
    return pixels;
}

std::string problemOf(const std::function<void()>& work) {
    try {
        work();
    } catch (const std::runtime_error& problem) {
        return problem.what();
    }
    ADD_FAILURE() << "nothing was wrong";
    return "";
}

std::string problemOf(const Ktx2File& file) {
    return problemOf([&] { pixelsOf(file); });
}

/// Returns the selectors of the four texels of a row, from left to right.
std::uint32_t rowOf(std::uint32_t a, std::uint32_t b, std::uint32_t c, std::uint32_t d) {
    return a | b << 2U | c << 4U | d << 6U;
}

/// Returns four endpoints with different reds: 0, 8, 16, 24 in 5 bits, which are 0, 66, 132, 198 in
/// 8 bits. Selector 2 adds 2.
BasisBooks redBooks() {
    BasisBooks books;
    books.endpoints = {{0, 0, 0, 0}, {8, 0, 0, 0}, {16, 0, 0, 0}, {24, 0, 0, 0}};
    books.selectors = {0xAAAAAAAA};
    return books;
}
constexpr std::uint8_t kReds[] = {2, 68, 134, 200};

/// Returns the red of the upper left texel of each block.
std::vector<std::uint8_t> redsOf(const Ktx2File& file) {
    const std::vector<Color> pixels = pixelsOf(file);
    std::vector<std::uint8_t> reds;
    for (std::size_t y = 0; y < file.height; y += 4)
        for (std::size_t x = 0; x < file.width; x += 4)
            reds.push_back(pixels[y * file.width + x][0]);
    return reds;
}

TEST(BasisEtc1s, HasTheModifiersOfTheTable) {
    // The table "Intensity modifier sets for ETC1 compressed textures". Its columns are a and b of
    // the selectors −b, −a, +a, +b.
    constexpr int kModifiers[8][2] = {{2, 8},   {5, 17},  {9, 29},   {13, 42},
                                      {18, 60}, {24, 80}, {33, 106}, {47, 183}};
    BasisBooks books;
    books.selectors = {rowOf(0, 1, 2, 3) | rowOf(3, 2, 1, 0) << 8U | rowOf(0, 0, 3, 3) << 16U |
                       rowOf(2, 1, 2, 1) << 24U};
    books.endpoints.clear();
    std::vector<BasisBlock> blocks;
    for (unsigned intensity = 0; intensity < 8; ++intensity) {
        // The specification's example: 28, 4 and 3 in 5 bits are 231, 33 and 24 in 8 bits.
        books.endpoints.push_back({28, 4, 3, intensity});
        blocks.push_back({intensity, 0});
    }
    const Ktx2File file = basisFile(32, 4, books, {plainSlice(books, 8, blocks)});
    const std::vector<Color> pixels = pixelsOf(file);
    const unsigned grid[4][4] = {{0, 1, 2, 3}, {3, 2, 1, 0}, {0, 0, 3, 3}, {2, 1, 2, 1}};
    for (std::size_t y = 0; y < 4; ++y)
        for (std::size_t x = 0; x < 32; ++x) {
            const int(&modifiers)[2] = kModifiers[x / 4];
            const int by[] = {-modifiers[1], -modifiers[0], modifiers[0], modifiers[1]};
            const auto channel = [&](int base) {
                return static_cast<std::uint8_t>(
                    std::min(std::max(base + by[grid[y][x % 4]], 0), 255));
            };
            EXPECT_EQ(pixels[y * 32 + x], (Color{channel(231), channel(33), channel(24), 255}))
                << x << ' ' << y;
        }
}

TEST(BasisEtc1s, HasCodebooksOfEveryKind) {
    BasisBooks books;
    books.endpoints = {{31, 31, 31, 7}, {0, 0, 0, 1}, {10, 10, 10, 2}, {22, 22, 22, 3}};
    books.selectors = {0x00000000, 0xFFFFFFFF, 0x12345678, 0xAAAAAAAA};
    const std::vector<BasisBlock> blocks = {{0, 0}, {1, 1}, {2, 2}, {3, 3}, {3, 0}};
    std::vector<std::vector<Color>> pictures;
    for (const bool grey : {false, true})
        for (const bool plain : {false, true}) {
            books.grey = grey;
            books.plain = plain;
            pictures.push_back(pixelsOf(basisFile(20, 4, books, {plainSlice(books, 5, blocks)})));
            EXPECT_EQ(pictures.back(), pictures[0]);
        }
    EXPECT_EQ(pictures[0][0], (Color{72, 72, 72, 255}));  // 255 − 183
    EXPECT_EQ(pictures[0][4], (Color{17, 17, 17, 255}));  // 0 + 17
    // 82 − 29; the selector is 0, from the lowest bits of 0x78
    EXPECT_EQ(pictures[0][8], (Color{53, 53, 53, 255}));
    EXPECT_EQ(pictures[0][9], (Color{91, 91, 91, 255}));      // 82 + 9; the selector is 2
    EXPECT_EQ(pictures[0][12], (Color{194, 194, 194, 255}));  // 181 + 13
}

TEST(BasisEtc1s, HasASecondSliceForAlpha) {
    BasisBooks books = redBooks();
    books.endpoints.push_back({31, 8, 31, 0});  // the green of the second slice becomes alpha
    const std::vector<Bytes> slices = {plainSlice(books, 1, {{1, 0}}),
                                       plainSlice(books, 1, {{4, 0}})};
    for (const Color& pixel : pixelsOf(basisFile(4, 4, books, slices)))
        EXPECT_EQ(pixel, (Color{68, 2, 2, 68}));
}

TEST(BasisEtc1s, RefersToTheBlocksAround) {
    // The symbol has two bits for each of 2 × 2 blocks, from the lowest bits: 0 left, 1 above, 2
    // above left, 3 explicit.
    const BasisBooks books = redBooks();
    const auto sliceOf = [&](unsigned predictions, const std::vector<std::size_t>& deltas) {
        BitWriter bits;
        books.predictions.put(bits, predictions);
        std::size_t next = 0;
        for (unsigned block = 0; block < 4; ++block) {
            if ((predictions >> (2 * block) & 3U) == 3) books.deltas().put(bits, deltas[next++]);
            books.codes().put(bits, 0);
        }
        return basisFile(8, 8, books, {bits.bytes()});
    };
    const auto reds = [&](const std::vector<std::size_t>& endpoints) {
        std::vector<std::uint8_t> out;
        for (const std::size_t endpoint : endpoints)
            out.push_back(kReds[endpoint]);
        return out;
    };
    // Explicit differences wrap around: 1, 1 + 3 = 0, 0 + 2 = 2, 2 + 1 = 3.
    EXPECT_EQ(redsOf(sliceOf(0xFF, {1, 3, 2, 1})), reds({1, 0, 2, 3}));
    // Block 1 refers to its left neighbour.
    EXPECT_EQ(redsOf(sliceOf(0xF3, {1, 2, 3})), reds({1, 1, 3, 2}));
    // The lower blocks refer to the blocks above.
    EXPECT_EQ(redsOf(sliceOf(0x5F, {1, 1})), reds({1, 2, 1, 2}));
    // The last block refers to its upper left neighbour.
    EXPECT_EQ(redsOf(sliceOf(0xBF, {1, 1, 1})), reds({1, 2, 3, 1}));
    for (const unsigned wrong : {0xFCU, 0xFDU, 0xFEU, 0xF7U, 0xFBU, 0xCFU, 0xEFU})
        EXPECT_TRUE(contains(problemOf(sliceOf(wrong, {0, 0, 0})), "outside the picture")) << wrong;
}

TEST(BasisEtc1s, RepeatsPredictions) {
    // A row of nine pairs of blocks. The first pair's symbol is explicit; the next symbol repeats
    // it 3 + 5 times.
    const BasisBooks books = redBooks();
    BitWriter bits;
    books.predictions.put(bits, 0xFF);
    for (int pair = 0; pair < 9; ++pair) {
        if (pair == 1) {
            books.predictions.put(bits, 256);
            bits.put(5, 5);
        }
        for (int block = 0; block < 2; ++block) {
            books.deltas().put(bits, 1);
            books.codes().put(bits, 0);
        }
    }
    const auto reds = redsOf(basisFile(72, 4, books, {bits.bytes()}));
    for (std::size_t i = 0; i < reds.size(); ++i)
        EXPECT_EQ(reds[i], kReds[(i + 1) % 4]);
}

/// Returns a row of blocks with endpoint 0. `write` writes the selector of each block.
Ktx2File selectorsFile(const BasisBooks& books, std::uint32_t count,
                       const std::function<void(BitWriter&, std::size_t)>& write) {
    BitWriter bits;
    for (std::size_t i = 0; i < count; ++i) {
        if (i % 2 == 0) books.predictions.put(bits, 0xFF);
        books.deltas().put(bits, 0);
        write(bits, i);
    }
    return basisFile(4 * count, 4, books, {bits.bytes()});
}

/// Returns codebooks with one endpoint and four selectors. Each selector has a single value for all
/// texels; the four reds are 132 − 8, 132 − 2, 132 + 2 and 132 + 8.
BasisBooks selectorBooks(std::size_t history) {
    BasisBooks books;
    books.selectors = {0x00000000, 0x55555555, 0xAAAAAAAA, 0xFFFFFFFF};
    books.history = history;
    return books;
}
std::vector<std::uint8_t> shown(const std::vector<std::size_t>& selectors) {
    constexpr std::uint8_t kShown[] = {124, 130, 134, 140};
    std::vector<std::uint8_t> out;
    for (const std::size_t selector : selectors)
        out.push_back(kShown[selector]);
    return out;
}

TEST(BasisEtc1s, RemembersSelectors) {
    // Symbols from 4 on are positions in the history. New selectors replace the last two entries in
    // turn; a used entry is swapped with the entry at half its position.
    const BasisBooks books = selectorBooks(4);
    const std::vector<std::size_t> symbols = {1, 2, 6, 5, 4, 3, 6, 7};
    // The history is {0 0 1 0} after 1 and {0 0 1 2} after 2. Position 2 gives 1: {0 1 0 2}.
    // Position 1 gives 1: {1 0 0 2}. Position 0 gives 1. 3 is new, at position 2: {1 0 3 2}.
    // Position 2 gives 3: {1 3 0 2}. Position 3 gives 2.
    const auto file =
        selectorsFile(books, static_cast<std::uint32_t>(symbols.size()),
                      [&](BitWriter& bits, std::size_t i) { books.codes().put(bits, symbols[i]); });
    EXPECT_EQ(redsOf(file), shown({1, 2, 1, 1, 1, 3, 3, 2}));
}

TEST(BasisEtc1s, RepeatsSelectors) {
    // The symbol after the history's positions repeats the history's first entry: 3 + 1 times, then
    // 3 + 62 times with an explicit length.
    const BasisBooks books = selectorBooks(2);
    const auto file = selectorsFile(books, 72, [&](BitWriter& bits, std::size_t i) {
        if (i == 0) books.codes().put(bits, 3);  // stores selector 3 at position 1 of the history
        if (i == 1) books.codes().put(bits, 5);  // swaps positions 0 and 1 of the history
        if (i == 2 || i == 6) books.codes().put(bits, 6);
        if (i == 2) books.runs.put(bits, 1);
        if (i == 6) {
            books.runs.put(bits, 63);
            bits.put(62, 8);
        }
        if (i == 71) books.codes().put(bits, 0);
    });
    std::vector<std::size_t> expected(72, 3);
    expected.back() = 0;
    EXPECT_EQ(redsOf(file), shown(expected));
    // The length is written in two pieces: 3 + (4 + 128).
    const auto longer = selectorsFile(books, 139, [&](BitWriter& bits, std::size_t i) {
        if (i == 0) books.codes().put(bits, 3);
        if (i == 1) books.codes().put(bits, 5);
        if (i == 2) {
            books.codes().put(bits, 6);
            books.runs.put(bits, 63);
            bits.put(0x80 | 4, 8);
            bits.put(1, 8);
        }
        if (i >= 137) books.codes().put(bits, 1);
    });
    expected.assign(137, 3);
    expected.insert(expected.end(), 2, 1);
    EXPECT_EQ(redsOf(longer), shown(expected));
}

TEST(BasisEtc1s, RefusesRunsThatHaveNoEndOrNothingToRepeat) {
    const BasisBooks endless = selectorBooks(2);
    EXPECT_TRUE(contains(problemOf(selectorsFile(endless, 8,
                                                 [&](BitWriter& bits, std::size_t) {
                                                     endless.codes().put(bits, 6);
                                                     endless.runs.put(bits, 63);
                                                     bits.put(~std::uint64_t{0}, 48);
                                                 })),
                         "does not end"));
    const BasisBooks nothing = selectorBooks(0);
    EXPECT_TRUE(contains(problemOf(selectorsFile(nothing, 8,
                                                 [&](BitWriter& bits, std::size_t) {
                                                     nothing.codes().put(bits, 4);
                                                     nothing.runs.put(bits, 0);
                                                 })),
                         "there is no history"));
}

TEST(BasisEtc1s, RefusesWhatIsCutShort) {
    const BasisBooks books = selectorBooks(1);
    const std::vector<BasisBlock> blocks(16, {0, 2});
    const Ktx2File whole = basisFile(64, 4, books, {plainSlice(books, 16, blocks)});
    EXPECT_NO_THROW(pixelsOf(whole));
    Ktx2File file = whole;
    file.levels[0].bytes.pop_back();
    setNumber(file.global, 28, file.levels[0].bytes.size());
    EXPECT_TRUE(contains(problemOf(file), "slice of BasisLZ is cut short"));
    file.levels[0].bytes.pop_back();
    EXPECT_TRUE(contains(problemOf(file), "does not fit its level"));
    // Truncates the endpoints, selectors and tables of the global data to half, one at a time.
    const char* const words[] = {"cut short", "cut short", "cut short"};
    for (std::size_t part = 0; part < 3; ++part) {
        file = whole;
        std::size_t at = 40;
        std::uint64_t sizes[3] = {};
        for (std::size_t i = 0; i < 3; ++i)
            for (std::size_t b = 4; b-- > 0;)
                sizes[i] = sizes[i] << 8U | file.global[4 + 4 * i + b];
        for (std::size_t i = 0; i < part; ++i)
            at += sizes[i];
        const std::uint64_t kept = part == 2 ? 20 : sizes[part] - 2;
        file.global.erase(file.global.begin() + static_cast<std::ptrdiff_t>(at + kept),
                          file.global.begin() + static_cast<std::ptrdiff_t>(at + sizes[part]));
        setNumber(file.global, 4 + 4 * part, kept);
        EXPECT_TRUE(contains(problemOf(file), words[part])) << part << problemOf(file);
        file.global.pop_back();
        EXPECT_TRUE(contains(problemOf(file), "reach beyond the global data")) << part;
    }
    file = whole;
    file.global.push_back(0);
    EXPECT_TRUE(contains(problemOf(file), "data follows the last part"));
    file = whole;
    file.global.resize(19);
    EXPECT_TRUE(contains(problemOf(file), "reach beyond the global data"));
}

TEST(BasisEtc1s, RefusesGlobalDataThatContradictsItself) {
    const BasisBooks books = selectorBooks(1);
    const Ktx2File whole = basisFile(4, 4, books, {plainSlice(books, 1, {{0, 2}})});
    const auto problemWith = [&](std::size_t at, std::uint64_t value, std::size_t size) {
        Ktx2File file = whole;
        setNumber(file.global, at, value, size);
        return problemOf(file);
    };
    EXPECT_TRUE(contains(problemWith(0, 0, 2), "0 endpoints"));
    EXPECT_TRUE(contains(problemWith(2, 0, 2), "0 selectors"));
    EXPECT_TRUE(contains(problemWith(16, 1, 4), "1 bytes of extended data"));
    EXPECT_TRUE(contains(problemWith(20, 2, 4), "frame of a video"));
    EXPECT_TRUE(contains(problemWith(28, 0, 4), "slice of 0 bytes"));
    EXPECT_TRUE(contains(problemWith(24, 1, 4), "does not fit its level"));
    EXPECT_TRUE(contains(problemWith(32, 1, 4), "unexpected alpha slice"));
    EXPECT_TRUE(contains(problemWith(2, 1, 2), "unknown symbols"));
    Ktx2File alpha = whole;
    alpha.channels = {0, 15};
    EXPECT_TRUE(contains(problemOf(alpha), "slice of 0 bytes"));
    // The error names the position of the byte in the image description.
    EXPECT_TRUE(
        contains(problemOf(alpha), "byte " + std::to_string(20 + alpha.descriptorAt() + 60 + 4)));
}

/// Writes a table with these code lengths and reads it back.
HuffmanTable tableOf(const std::vector<std::uint8_t>& lengths) {
    BitWriter bits;
    BasisCode(lengths).putTable(bits);
    BitReader reader(bits.bytes(), 0);
    return HuffmanTable::read(reader);
}

TEST(HuffmanTable, DecodesWhatWasEncoded) {
    // The code has all lengths from 1 to 16.
    std::vector<std::uint8_t> lengths;
    for (std::uint8_t length = 1; length <= 16; ++length)
        lengths.push_back(length);
    lengths.push_back(16);
    const BasisCode code(lengths);
    const HuffmanTable table = tableOf(lengths);
    EXPECT_EQ(table.symbols(), 17U);
    BitWriter bits;
    for (int round = 0; round < 3; ++round)
        for (std::size_t symbol = 0; symbol < lengths.size(); ++symbol)
            code.put(bits, (symbol * 5) % lengths.size());
    BitReader reader(bits.bytes(), 0);
    for (int round = 0; round < 3; ++round)
        for (std::size_t symbol = 0; symbol < lengths.size(); ++symbol)
            ASSERT_EQ(table.decode(reader), (symbol * 5) % lengths.size());
    EXPECT_FALSE(reader.overrun());
    EXPECT_EQ(reader.position(), bits.count() / 8);
}

TEST(HuffmanTable, RefusesLengthsThatMakeNoCode) {
    EXPECT_TRUE(contains(problemOf([] { tableOf({1, 1, 1}); }), "too many"));
    EXPECT_TRUE(contains(problemOf([] { tableOf({2, 2, 2}); }), "too few"));
    EXPECT_TRUE(contains(problemOf([] { tableOf({1, 16}); }), "too few"));
    // A code may consist of a single symbol. Then the other bit is invalid.
    const HuffmanTable one = tableOf({0, 1});
    const Bytes bits = {0x02};
    BitReader reader(bits, 100);
    EXPECT_EQ(one.decode(reader), 1U);
    EXPECT_TRUE(contains(problemOf([&] { one.decode(reader); }), "byte 100"));
    EXPECT_EQ(tableOf({0, 0}).symbols(), 0U);
    EXPECT_TRUE(contains(problemOf([&] { HuffmanTable().decode(reader); }), "not a Huffman code"));
}

TEST(HuffmanTable, TakesRunsOfLengths) {
    const BasisCode lengths = BasisCode::ofLengths();
    const auto read = [&](std::size_t symbols,
                          const std::vector<std::array<std::size_t, 3>>& runs) {
        BitWriter bits;
        BasisCode::putHeader(bits, symbols);
        for (const auto& [symbol, extra, size] : runs) {
            lengths.put(bits, symbol);
            bits.put(extra, size);
        }
        BitReader reader(bits.bytes(), 0);
        return HuffmanTable::read(reader);
    };
    // The code lengths: 3 zeros, 11 zeros, a 4, then 3 and 7 + 5 repetitions: 16 codes of 4 bits.
    const HuffmanTable table =
        read(30, {{17, 0, 3}, {18, 0, 7}, {4, 0, 0}, {19, 0, 2}, {20, 5, 7}});
    EXPECT_EQ(table.symbols(), 30U);
    const Bytes bits = {0x80};  // the bits of code 0, then of code 1, highest bit first
    BitReader reader(bits, 0);
    EXPECT_EQ(table.decode(reader), 14U);
    EXPECT_EQ(table.decode(reader), 15U);

    const auto problem = [&](std::size_t symbols,
                             const std::vector<std::array<std::size_t, 3>>& runs) {
        return problemOf([&] { read(symbols, runs); });
    };
    EXPECT_TRUE(contains(problem(10, {{19, 0, 2}}), "a missing length"));
    EXPECT_TRUE(contains(problem(10, {{17, 0, 3}, {20, 0, 7}}), "a missing length"));
    EXPECT_TRUE(contains(problem(5, {{17, 7, 3}}), "more lengths than symbols"));
    EXPECT_TRUE(contains(problem(5, {{4, 0, 0}, {19, 3, 2}}), "more lengths than symbols"));
    EXPECT_TRUE(contains(problem(16383, {{18, 127, 7}}), "cut short"));
    for (const unsigned stored : {0U, 22U}) {
        BitWriter header;
        header.put(5, 14);
        header.put(stored, 5);
        BitReader damaged(header.bytes(), 0);
        EXPECT_TRUE(contains(problemOf([&] { HuffmanTable::read(damaged); }), "code length codes"));
    }
}

}  // namespace
}  // namespace peeler::test
