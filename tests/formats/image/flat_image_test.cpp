// SPDX-License-Identifier: Apache-2.0
// Tests pictures in every format, written and read back, linear and premultiplied.
#include "formats/image/flat_image.h"

#include <OpenImageIO/imageio.h>
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <fstream>
#include <utility>
#include <vector>

#include <peeler/error.h>
#include "core/base/color.h"
#include "formats/writers.h"
#include "support/test_support.h"

namespace peeler {
namespace {

using Pixel = std::array<float, 4>;

class FlatImageFile : public testing::Test {
  protected:
    std::string path(const std::string& name) const { return (scratch_ / name).string(); }

    /// Writes two adjacent pixels, one half covered and one opaque. Returns the path.
    std::string write(const std::string& name) const {
        CompositeImage picture;
        picture.window = {0, 0, 2, 1};
        picture.rgba = {Pixel{0.1F, 0.2F, 0.3F, 0.5F}, Pixel{0.5F, 0.25F, 1, 1}};
        writePicture(path(name), picture, {});
        return path(name);
    }

    void expectPixels(const FlatImage& flat, float tolerance) const {
        ASSERT_EQ(flat.image.rgba.size(), 2U);
        const Pixel expected[] = {{0.1F, 0.2F, 0.3F, 0.5F}, {0.5F, 0.25F, 1, 1}};
        for (std::size_t p = 0; p < 2; ++p) {
            for (std::size_t c = 0; c < 4; ++c)
                EXPECT_NEAR(flat.image.rgba[p][c], expected[p][c], tolerance) << p << ' ' << c;
        }
    }

    test::ScratchDir scratch_;
};

TEST_F(FlatImageFile, PngTiffAndExr) {
    expectPixels(readFlatImage(write("a.png")), 0.005F);
    expectPixels(readFlatImage(write("a.tif")), 0.00003F);
    const FlatImage exr = readFlatImage(write("a.exr"));
    expectPixels(exr, 0);
    EXPECT_TRUE(exr.placed);
    EXPECT_EQ(exr.width, 2);
    EXPECT_EQ(exr.image.window, (Window{0, 0, 2, 1}));
    EXPECT_FALSE(readFlatImage(path("a.png")).placed);
}

TEST_F(FlatImageFile, JpegHasNoAlpha) {
    const FlatImage flat = readFlatImage(write("a.jpg"));
    EXPECT_EQ(flat.image.rgba[0][3], 1);
    EXPECT_NEAR(flat.image.rgba[1][2], 1, 0.05);
}

/// Writes unchanged samples with OpenImageIO.
template <class T>
void writeSamples(const std::string& path, OIIO::ImageSpec spec, const std::vector<T>& samples) {
    const auto output = OIIO::ImageOutput::create(path);
    ASSERT_TRUE(output && output->open(path, spec));
    ASSERT_TRUE(output->write_image(OIIO::BaseTypeFromC<T>::value, samples.data()));
    ASSERT_TRUE(output->close());
}

TEST_F(FlatImageFile, OfATiffIsTurnedAsItsTagSays) {
    // A picture of 2 x 3 numbered pixels. `seen` has them in viewing order for each orientation of
    // TIFF 6.0, section 8.
    const std::vector<std::uint16_t> stored = {1, 2, 3, 4, 5, 6};
    const std::vector<std::vector<int>> seen = {
        {1, 2, 3, 4, 5, 6}, {2, 1, 4, 3, 6, 5}, {6, 5, 4, 3, 2, 1}, {5, 6, 3, 4, 1, 2},
        {1, 3, 5, 2, 4, 6}, {5, 3, 1, 6, 4, 2}, {6, 4, 2, 5, 3, 1}, {2, 4, 6, 1, 3, 5}};
    for (int orientation = 1; orientation <= 8; ++orientation) {
        SCOPED_TRACE(orientation);
        OIIO::ImageSpec spec(2, 3, 1, OIIO::TypeDesc::UINT16);
        spec.attribute("Orientation", orientation);
        writeSamples(path("o.tif"), spec, stored);
        const FlatImage flat = readFlatImage(path("o.tif"));
        EXPECT_EQ(flat.width, orientation > 4 ? 3 : 2);
        EXPECT_EQ(flat.image.window, (Window{0, 0, flat.width, flat.height}));
        std::vector<int> numbers;
        for (const auto& pixel : flat.image.rgba)
            numbers.push_back(static_cast<int>(std::lround(pixel[0] * 65535 * 12.92F)));
        EXPECT_EQ(numbers, seen[static_cast<std::size_t>(orientation - 1)]);
    }
}

TEST_F(FlatImageFile, OfAJpegIsTurnedAsItsExifSays) {
    OIIO::ImageSpec spec(16, 8, 3, OIIO::TypeDesc::UINT8);
    spec.attribute("Orientation", 6);
    std::vector<std::uint8_t> pixels(16 * 8 * 3);
    std::fill_n(pixels.begin(), 16 * 4 * 3, std::uint8_t{255});  // the upper half is white
    writeSamples(path("a.jpg"), spec, pixels);
    const FlatImage flat = readFlatImage(path("a.jpg"));
    EXPECT_EQ(flat.width, 8);
    EXPECT_EQ(flat.height, 16);
    // The white half, formerly at the top, is now on the right.
    EXPECT_NEAR(flat.image.rgba[0][0], 0, 0.01);
    EXPECT_NEAR(flat.image.rgba[7][0], 1, 0.01);
}

TEST_F(FlatImageFile, GreyWithAndWithoutAlpha) {
    writeSamples<std::uint8_t>(path("g.png"), OIIO::ImageSpec(1, 1, 1, OIIO::TypeDesc::UINT8),
                               {188});
    const Pixel grey = readFlatImage(path("g.png")).image.rgba[0];
    EXPECT_NEAR(grey[0], 0.5029, 1e-4);
    EXPECT_EQ(grey[2], grey[0]);
    EXPECT_EQ(grey[3], 1);
}

TEST_F(FlatImageFile, FloatingPointTiffIsLinear) {
    writeSamples<float>(path("f.tif"), OIIO::ImageSpec(1, 1, 3, OIIO::TypeDesc::FLOAT),
                        {0.5F, 7, -1});
    EXPECT_EQ(readFlatImage(path("f.tif")).image.rgba[0], (Pixel{0.5F, 7, -1, 1}));
}

struct Tiff {
    std::uint32_t photometric = 5;  ///< TIFF 6.0: 0 = white is zero, 3 = palette, 5 = separated
    int channels = 4, bits = 8, rows = 1;
    bool tiled = false;
};

/// Returns an uncompressed TIFF with 64 pixels per row and all bits 0, in one strip per row or in
/// one tile.
std::string stored(const Tiff& tiff) {
    constexpr std::uint32_t kWidth = 64, kShort = 3, kLong = 4, kTile = 64;
    const auto count = static_cast<std::uint32_t>(tiff.channels);
    const auto bits = static_cast<std::uint32_t>(tiff.bits);
    const auto rows = static_cast<std::uint32_t>(tiff.rows);
    const std::uint32_t bytes = kWidth * count * bits / 8;
    const auto number = [](std::uint32_t value, std::size_t size) {
        std::string text;
        for (std::size_t i = 0; i < size; ++i)
            text += static_cast<char>(value >> (8 * i));
        return text;
    };
    std::string entries, lists;
    std::uint32_t entry_count = 0;
    const auto list_place = [&] {
        return 8 + 2 + 12 * 16 + 4 + static_cast<std::uint32_t>(lists.size());
    };
    const auto entry = [&](std::uint32_t tag, std::uint32_t type,
                           const std::vector<std::uint32_t>& values) {
        const std::size_t size = type == kShort ? 2 : 4;
        std::string text;
        for (const std::uint32_t value : values)
            text += number(value, size);
        if (text.size() > 4) {
            lists += std::exchange(text, number(list_place(), 4));
        }
        text.resize(4, '\0');
        entries += number(tag, 2) + number(type, 2) +
                   number(static_cast<std::uint32_t>(values.size()), 4) + text;
        ++entry_count;
    };
    constexpr std::uint32_t kPixels = 1U << 18U;  // offset of the pixels, after all lists
    entry(256, kLong, {kWidth});
    entry(257, kLong, {rows});
    entry(258, kShort, std::vector<std::uint32_t>(count, bits));
    entry(259, kShort, {1});
    entry(262, kShort, {tiff.photometric});
    if (!tiff.tiled) entry(273, kLong, std::vector<std::uint32_t>(rows, kPixels));
    entry(277, kShort, {count});
    if (!tiff.tiled) {
        entry(278, kLong, {1});
        entry(279, kLong, std::vector<std::uint32_t>(rows, bytes));
    }
    entry(284, kShort, {1});
    if (tiff.photometric == 3)
        entry(320, kShort, std::vector<std::uint32_t>(std::size_t{3} << bits));
    if (tiff.tiled) {
        entry(322, kLong, {kTile});
        entry(323, kLong, {kTile});
        entry(324, kLong, {kPixels});
        entry(325, kLong, {kTile * bytes});
    }
    std::string file = std::string("II*\0", 4) + number(8, 4) + number(entry_count, 2) + entries;
    file += number(0, 4);
    file.resize(8 + 2 + 12 * 16 + 4);
    file += lists;
    file.resize(kPixels + (tiff.tiled ? kTile : 1) * bytes);
    return file;
}

TEST_F(FlatImageFile, TiffIsReadRowByRow) {
    const auto with = [&](const Tiff& tiff) {
        std::ofstream(path("a.tif"), std::ios::binary) << stored(tiff);
        return readFlatImage(path("a.tif")).image;
    };
    for (const int channels : {1, 3}) {
        const CompositeImage white = with({.photometric = 0, .channels = channels, .rows = 200});
        EXPECT_EQ(white.window, (Window{0, 0, 64, 200}));
        for (const auto& pixel : white.rgba)
            ASSERT_EQ(pixel, (Pixel{1, 1, 1, 1})) << channels;
    }
    EXPECT_EQ(with({.photometric = 3, .channels = 1}).rgba[63], (Pixel{0, 0, 0, 1}));
}

TEST_F(FlatImageFile, TiffThatItsReaderWritesBeyondIsRefused) {
    const auto what = [&](const Tiff& tiff) -> std::string {
        std::ofstream(path("a.tif"), std::ios::binary) << stored(tiff);
        try {
            EXPECT_EQ(readFlatImage(path("a.tif")).image.rgba[63], (Pixel{1, 1, 1, 1}));
            return "";
        } catch (const Error& error) {
            EXPECT_EQ(error.kind(), ErrorKind::kInput);
            return error.what();
        }
    };
    for (const int bits : {8, 16})
        EXPECT_EQ(what({.bits = bits}), "");
    for (const int bits : {1, 2, 4, 10, 12, 24})
        EXPECT_TRUE(what({.bits = bits})
                        .ends_with("CMYK of " + std::to_string(bits) + " bits is not read"));
    for (const int bits : {8, 16})
        EXPECT_TRUE(
            what({.bits = bits, .rows = 64, .tiled = true}).ends_with("CMYK in tiles is not read"));
}

TEST_F(FlatImageFile, ExrChannelsInAnyPlaceAndTiles) {
    OIIO::ImageSpec spec(40, 40, 5, OIIO::TypeDesc::FLOAT);
    spec.channelnames = {"A", "B", "G", "R", "depth"};
    spec.x = 10;
    spec.full_width = 100;
    spec.full_height = 60;
    spec.tile_width = spec.tile_height = 16;
    std::vector<float> samples;
    for (int i = 0; i < 40 * 40; ++i)
        samples.insert(samples.end(), {0.5F, 0.3F, 0.2F, 0.1F, 99});
    const auto output = OIIO::ImageOutput::create("openexr");
    ASSERT_TRUE(output->open(path("t.exr"), spec));
    ASSERT_TRUE(output->write_image(OIIO::TypeDesc::FLOAT, samples.data()));
    ASSERT_TRUE(output->close());
    const FlatImage flat = readFlatImage(path("t.exr"));
    EXPECT_EQ(flat.image.window, (Window{10, 0, 50, 40}));
    EXPECT_EQ(flat.width, 100);
    EXPECT_EQ(flat.height, 60);
    EXPECT_EQ(flat.image.rgba[777], (Pixel{0.1F, 0.2F, 0.3F, 0.5F}));
}

TEST_F(FlatImageFile, WhatIsWrongIsSaid) {
    const auto refused = [](const std::string& file, const FlatImageLimits& limits = {}) {
        try {
            readFlatImage(file, limits);
        } catch (const Error& error) {
            EXPECT_EQ(error.kind(), ErrorKind::kInput);
            EXPECT_EQ(error.where(), file);
            return std::string(error.what());
        }
        return std::string("nothing");
    };
    std::ofstream(path("text.png")) << "not a picture";
    EXPECT_NE(refused(path("text.png")).find("neither"), std::string::npos);
    EXPECT_NE(refused(path("missing.png")).find("does not exist"), std::string::npos);
    const std::string png = write("a.png");
    EXPECT_NE(refused(png, {.max_side = 1}).find("larger than the limit"), std::string::npos);
    EXPECT_NE(refused(png, {.max_bytes = 31}).find("larger than the limit"), std::string::npos);
    const std::string bytes = test::bytesOf(png);
    for (const std::size_t kept : {std::size_t{8}, std::size_t{20}, bytes.size() - 20}) {
        std::ofstream(path("cut.png"), std::ios::binary) << bytes.substr(0, kept);
        EXPECT_NE(refused(path("cut.png")), "nothing") << kept;
    }
}

TEST_F(FlatImageFile, NoMemoryIsTakenForAttributesThatAreNotThere) {
    write("a.exr");
    std::string bytes = test::bytesOf(path("a.exr"));
    const std::string type = std::string("software") + '\0' + "string" + '\0';
    const std::size_t size = bytes.find(type) + type.size();
    ASSERT_LT(size, bytes.size());
    bytes.replace(size, 4, "\xFF\xFF\xFF\x7F");
    std::ofstream(path("b.exr"), std::ios::binary) << bytes;
    try {
        readFlatImage(path("b.exr"));
        ADD_FAILURE() << "it was read";
    } catch (const Error& error) {
        EXPECT_EQ(error.kind(), ErrorKind::kInput);
        EXPECT_TRUE(test::contains(error.what(), "software"));
    }
}

}  // namespace
}  // namespace peeler
