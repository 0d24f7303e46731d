// SPDX-License-Identifier: Apache-2.0
// Tests samples for LaRI and X-Ray, made of known fragments. Tests in tests/cmd read samples like
// the loaders of LaRI and X-Ray.
#include <Imath/half.h>
#include <gtest/gtest.h>

#include <cmath>

#include <peeler/error.h>
#include "core/image/channels.h"
#include "formats/arrays/fragment_tables.h"
#include "formats/exr/synthetic_image.h"
#include "formats/image/display.h"
#include "formats/image/flat_image.h"
#include "formats/output_hash.h"
#include "formats/writers.h"
#include "support/npz_file.h"
#include "support/test_support.h"

namespace peeler {
namespace {

using test::appendColor;
using test::appendValue;
using test::readNpz;
using test::ScratchDir;
using test::SyntheticPicture;

/// Returns four pixels with two, no, one and one fragments. The third pixel's fragment is black and
/// opaque; the fourth pixel's is invisible. The camera is at (10, 20, 30) and looks along +X, with
/// +Z on its right.
SyntheticPicture fourPixels() {
    SyntheticPicture picture;
    View& view = picture.plan.view;
    view.width = view.height = 2;
    view.crop = {0, 0, 2, 2};
    view.camera_to_world = {{0, 0, 1, 0}, {0, 1, 0, 0}, {-1, 0, 0, 0}, {10, 20, 30, 1}};
    LayeredImage& image = picture.image;
    image.window = view.crop;
    image.offsets = {0, 2, 2, 3, 4};
    image.z = {2, 8, 4, 16};
    image.color = {{"R", "G", "B", "A"}, PixelType::kFloat, {}};
    const float colors[4][4] = {{0.5F, 0, 0, 0.5F}, {0, 1, 0, 1}, {0, 0, 0, 1}, {0, 0, 0, 0}};
    for (const auto& color : colors)
        for (const float c : color)
            appendColor(image.color, c);
    picture.plan.color_type = PixelType::kFloat;
    picture.plan.layers = {{view.crop, 3}, {{0, 0, 1, 1}, 1}};
    picture.plan.fragments_counted = picture.plan.fragments_stored = 4;
    return picture;
}

/// Returns fourPixels() with the channels that X-Ray needs.
SyntheticPicture fourHits() {
    SyntheticPicture picture = fourPixels();
    FragmentArray normals{{"Ng.X", "Ng.Y", "Ng.Z"}, PixelType::kFloat, {}};
    FragmentArray colors{{"baseColor.R", "baseColor.G", "baseColor.B"}, PixelType::kHalf, {}};
    FragmentArray facing{{"facing"}, PixelType::kHalf, {}},
        distance{{"distance"}, PixelType::kFloat, {}};
    for (int f = 0; f < 4; ++f) {
        // The normals point to −X, toward the camera. Only the second fragment is a back face.
        for (const float n : {-1.0F, 0.0F, 0.0F})
            appendValue(normals.data, n);
        for (const float c : {0.0F, 0.25F, 1.0F})
            appendValue(colors.data, half(c).bits());
        appendValue(facing.data, half(f == 1 ? -1.0F : 1.0F).bits());
        appendValue(distance.data, static_cast<float>(f + 1));
    }
    picture.image.extra = {normals, colors, facing, distance};
    return picture;
}

TEST(LariSample, HasDepthsPoseAndAPictureOverBlack) {
    const ScratchDir scratch;
    OutputOptions options;
    options.as = "lari";
    options.provenance.output_hash = "0123456789abcdef";
    const std::string path = scratch / "003.png";
    const SyntheticPicture picture = fourPixels();
    test::writePicture(*makeSink(path, options), picture, {1});
    EXPECT_EQ(scratch.files(), (std::vector<std::string>{"003.npy", "003.png", "003_ldi.npz"}));

    const auto ldi = readNpz(scratch / "003_ldi.npz").at("ldi");
    EXPECT_EQ(ldi.type, "<f2");
    EXPECT_EQ(ldi.shape, "(2, 2, 15)");
    std::vector<std::uint16_t> expected(4 * 15, half(-1).bits());
    expected[0] = half(2).bits();
    expected[1] = half(8).bits();
    expected[2 * 15] = half(4).bits();
    expected[3 * 15] = half(16).bits();
    EXPECT_EQ(ldi.as<std::uint16_t>(), expected);

    // Blender's axes are our (x, −z, y). In Blender's axes, the camera is at (10, −30, 20) and
    // looks along +X, which is the camera's −Z. The camera's X points right, along −Y.
    const std::string npy = test::bytesOf(scratch / "003.npy");
    ASSERT_EQ(npy.size(), 128U + 12 * 8);
    EXPECT_TRUE(test::contains(npy.substr(0, 128), "'<f8'") &&
                test::contains(npy.substr(0, 128), "(3, 4)"));
    std::vector<double> pose(12);
    std::memcpy(pose.data(), npy.data() + 128, 96);
    EXPECT_EQ(pose, (std::vector<double>{0, -1, 0, -30, 0, 0, 1, -20, -1, 0, 0, 10}));

    // Pixel 0 has red 0.5, and green 0.5 · 1 from the fragment behind; 0.5 is 188 in sRGB. Covered
    // black pixels are stored as 1 of 255; alpha is 255 wherever there is a fragment.
    const auto rgba = [&](std::size_t p) {
        const auto image = readFlatImage(path).image.rgba[p];
        std::array<long, 4> bytes{};
        for (std::size_t c = 0; c < 3; ++c)
            bytes[c] = std::lround(255 * encodeSrgb(image[c]));
        bytes[3] = std::lround(255 * image[3]);
        return bytes;
    };
    EXPECT_EQ(rgba(0), (std::array<long, 4>{188, 188, 0, 255}));
    EXPECT_EQ(rgba(1), (std::array<long, 4>{0, 0, 0, 0}));
    EXPECT_EQ(rgba(2), (std::array<long, 4>{1, 1, 1, 255}));
    EXPECT_EQ(rgba(3), (std::array<long, 4>{1, 1, 1, 255}));
    EXPECT_EQ(outputHashOf(path), "0123456789abcdef");
    EXPECT_LE(std::filesystem::file_size(path) +
                  std::filesystem::file_size(scratch / "003_ldi.npz") + npy.size(),
              forecastPicture(path, picture.plan, options).bytes);
}

TEST(LariSample, AMeteredPictureKnowsWhatIsCovered) {
    const ScratchDir scratch;
    OutputOptions options;
    options.as = "lari";
    options.automatic_exposure = true;
    test::writePicture(*makeSink(scratch / "a.png", options), fourPixels(), {1});
    const auto rgba = readFlatImage(scratch / "a.png").image.rgba;
    EXPECT_EQ(rgba[1], (std::array<float, 4>{0, 0, 0, 0}));
    for (const std::size_t p : {0U, 2U, 3U})
        EXPECT_TRUE(rgba[p][3] == 1 && rgba[p][0] > 0) << p;
}

TEST(LariSample, AllFilesAppearOrNone) {
    for (const char* blocked : {"a.png", "a.npy", "a_ldi.npz"}) {
        const ScratchDir scratch;
        OutputOptions options;
        options.as = "lari";
        const auto sink = makeSink(scratch / "a.png", options);
        const SyntheticPicture picture = fourPixels();
        sink->begin(picture.plan);
        sink->write(LayeredImage(picture.image));
        // A rename cannot replace a non-empty folder, so this folder blocks the file.
        std::filesystem::create_directories(scratch / blocked / "full");
        EXPECT_THROW(sink->finish(), Error);
        EXPECT_EQ(scratch.files().size() - 1, [&] {
            std::size_t hidden = 0;
            for (const std::string& name : scratch.files())
                hidden += name.front() == '.' ? 1 : 0;
            return hidden;
        }()) << blocked;
        for (const char* name : {"a.png", "a.npy", "a_ldi.npz"})
            EXPECT_FALSE(std::filesystem::is_regular_file(scratch / name)) << name;
    }
}

TEST(Xray, IsAMatrixOfSixteenRows) {
    const ScratchDir scratch;
    OutputOptions options;
    options.as = "xray";
    const std::string path = scratch / "a.npz";
    const SyntheticPicture picture = fourHits();
    const SizeForecast told = forecastPicture(path, picture.plan, options);
    test::writePicture(*makeSink(path, options), picture, {1});
    EXPECT_EQ(told.certainty, Certainty::kExact);
    EXPECT_EQ(told.bytes, std::filesystem::file_size(path));
    const auto arrays = readNpz(path);
    EXPECT_EQ(arrays.at("shape").as<std::int64_t>(), (std::vector<std::int64_t>{16, 7 * 4}));
    const auto indptr = arrays.at("indptr").as<std::int32_t>();
    std::vector<std::int32_t> rows(17, 28);
    rows[0] = 0;
    rows[1] = 21;
    EXPECT_EQ(indptr, rows);
    EXPECT_EQ(arrays.at("data").type, "<f4");
    EXPECT_EQ(arrays.at("indices").type, "<i4");
    // Row 0: the first fragments of pixels 0, 2 and 3.
    const auto indices = arrays.at("indices").as<std::int32_t>();
    std::vector<std::int32_t> expected;
    for (int c = 0; c < 7; ++c)
        for (const int p : {0, 2, 3})
            expected.push_back(4 * c + p);
    for (int c = 0; c < 7; ++c)
        expected.push_back(4 * c);
    EXPECT_EQ(indices, expected);
    const auto data = arrays.at("data").as<float>();
    const auto row = [&](std::size_t first, std::size_t count, std::size_t c) {
        return std::vector<float>(
            data.begin() + static_cast<std::ptrdiff_t>(first + c * count),
            data.begin() + static_cast<std::ptrdiff_t>(first + (c + 1) * count));
    };
    EXPECT_EQ(row(0, 3, 0), (std::vector<float>{1, 3, 4}));
    // Normals toward the camera are +Z in camera space.
    EXPECT_EQ(row(0, 3, 1), (std::vector<float>{0, 0, 0}));
    EXPECT_EQ(row(0, 3, 2), (std::vector<float>{0, 0, 0}));
    EXPECT_EQ(row(0, 3, 3), (std::vector<float>{1, 1, 1}));
    EXPECT_EQ(row(21, 1, 3), (std::vector<float>{-1}));  // a back face
    EXPECT_EQ(row(0, 3, 4), (std::vector<float>{0, 0, 0}));
    EXPECT_NEAR(row(0, 3, 5)[0], 0.537099, 1e-5);  // the sRGB encoding of 0.25
    for (const float blue : row(0, 3, 6))
        EXPECT_FLOAT_EQ(blue, 1);
}

TEST(Xray, BandsDoNotMatterAndLayersBehindTheSixteenthAreLeftOut) {
    const ScratchDir scratch;
    OutputOptions options;
    options.as = "xray";
    SyntheticPicture picture = test::makePicture({.width = 160, .height = 140, .most_layers = 20});
    const std::size_t n = picture.image.fragments();
    for (const Channel channel : xrayChannels()) {
        FragmentArray array = emptyArray(channel, PixelType::kFloat);
        for (std::size_t i = 0; i < n * array.components(); ++i)
            appendValue(array.data, static_cast<float>(i % 97 + 1));
        picture.image.extra.push_back(array);
    }
    ASSERT_GT(picture.plan.layers.size(), 16U);
    test::writePicture(*makeSink(scratch / "a.npz", options), picture);
    const std::string whole = test::bytesOf(scratch / "a.npz");
    for (const int height : {1, 9, 33}) {
        test::writePicture(*makeSink(scratch / "b.npz", options), picture, {height});
        EXPECT_TRUE(test::bytesOf(scratch / "b.npz") == whole) << height;
    }
    std::uint64_t hits = 0;
    for (std::size_t k = 0; k < 16; ++k)
        hits += picture.plan.layers[k].pixels;
    EXPECT_EQ(readNpz(scratch / "a.npz").at("data").numbers.size(), 7 * 4 * hits);
}

TEST(Xray, SaysWhichChannelIsMissing) {
    const ScratchDir scratch;
    OutputOptions options;
    options.as = "xray";
    const SyntheticPicture picture = fourPixels();
    try {
        test::writePicture(*makeSink(scratch / "a.npz", options), picture);
        FAIL();
    } catch (const Error& error) {
        EXPECT_EQ(error.kind(), ErrorKind::kUsage);
        EXPECT_TRUE(test::contains(error.what(), "distance")) << error.what();
    }
    EXPECT_TRUE(scratch.files().empty());
}

}  // namespace
}  // namespace peeler
