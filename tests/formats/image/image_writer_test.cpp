// SPDX-License-Identifier: Apache-2.0
// Tests that known linear colours are written as known bytes, and that the table of formats
// describes its entries correctly.
#include "formats/image/image_writer.h"

#include <OpenImageIO/imageio.h>
#include <gtest/gtest.h>

#include <cmath>

#include <peeler/error.h>
#include "formats/exr/synthetic_image.h"
#include "formats/file/content_hash.h"
#include "formats/image/flat_image.h"
#include "formats/output_hash.h"
#include "formats/writers.h"
#include "support/test_support.h"

namespace peeler {
namespace {

namespace fs = std::filesystem;
using Rgba = std::array<float, 4>;

/// Returns one row of pixels with one fragment each. Pixels with alpha and colour 0 have none.
test::SyntheticPicture rowOfPixels(const std::vector<Rgba>& colors) {
    test::SyntheticPicture picture;
    const int width = static_cast<int>(colors.size());
    picture.plan.view.width = width;
    picture.plan.view.height = 1;
    picture.plan.view.crop = picture.image.window = {0, 0, width, 1};
    picture.plan.color_type = PixelType::kFloat;
    picture.image.color = {{"R", "G", "B", "A"}, PixelType::kFloat, {}};
    picture.image.offsets = {0};
    for (const Rgba& color : colors) {
        if (color != Rgba{}) {
            picture.image.z.push_back(1);
            for (const float value : color)
                test::appendValue(picture.image.color.data, value);
        }
        picture.image.offsets.push_back(static_cast<std::uint32_t>(picture.image.z.size()));
    }
    return picture;
}

struct Pixels {
    int width = 0, height = 0, channels = 0;
    std::vector<std::uint16_t> values;  ///< values as stored: 0–255 or 0–65535
};

Pixels readBack(const fs::path& path) {
    OIIO::ImageSpec config;
    config.attribute("oiio:UnassociatedAlpha", 1);  // keeps alpha straight
    const auto input = OIIO::ImageInput::open(path.string(), &config);
    if (!input) throw std::runtime_error(OIIO::geterror());
    const OIIO::ImageSpec& spec = input->spec();
    Pixels pixels{spec.width, spec.height, spec.nchannels, {}};
    const std::size_t count = static_cast<std::size_t>(spec.width) *
                              static_cast<std::size_t>(spec.height) *
                              static_cast<std::size_t>(spec.nchannels);
    pixels.values.resize(count);
    if (spec.format == OIIO::TypeDesc::UINT8) {
        std::vector<std::uint8_t> bytes(count);
        EXPECT_TRUE(
            input->read_image(0, 0, 0, spec.nchannels, OIIO::TypeDesc::UINT8, bytes.data()));
        std::copy(bytes.begin(), bytes.end(), pixels.values.begin());
    } else {
        EXPECT_TRUE(input->read_image(0, 0, 0, spec.nchannels, OIIO::TypeDesc::UINT16,
                                      pixels.values.data()));
    }
    return pixels;
}

Pixels writeAndRead(const fs::path& path, const test::SyntheticPicture& picture,
                    const OutputOptions& options = {}) {
    const auto sink = makeSink(path, options);
    test::writePicture(*sink, picture, {7});
    return readBack(path);
}

class ImageFile : public testing::Test {
  protected:
    test::ScratchDir scratch;
};

TEST_F(ImageFile, PngHasSrgbBytesAndStraightAlpha) {
    const Pixels pixels =
        writeAndRead(scratch / "out.png", rowOfPixels({{1, 0, 0.5F, 1},
                                                       {0.25F, 0, 0, 0.5F},
                                                       {},
                                                       {0.2158605F, 4, 0.0005F, 1},
                                                       {0.1F, 0.1F, 0.1F, 0.1F}}));
    ASSERT_EQ(pixels.channels, 4);
    // In sRGB, 0.5 is byte 188, and 0.2158605 is byte 128. 0.25 with alpha 0.5 is straight 0.5.
    // 0.0005 is in the linear toe: 0.00646·255 = 1.6.
    const std::vector<std::uint16_t> wanted = {255, 0, 188, 255, 188, 0,   0,   128, 0,   0,
                                               0,   0, 128, 255, 2,   255, 255, 255, 255, 26};
    EXPECT_EQ(pixels.values, wanted);
}

TEST_F(ImageFile, BackgroundExposureAndCrop) {
    OutputOptions options;
    options.background = {0, 0, 0.5F, 1};
    options.exposure = -1;
    const Pixels pixels = writeAndRead(
        scratch / "out.png", rowOfPixels({{}, {1, 1, 1, 1}, {0.5F, 0, 0, 0.5F}}), options);
    // The background is 0.5; the exposure does not change the background.
    const std::vector<std::uint16_t> wanted = {0, 0, 188, 255, 188, 188, 188,
                                               255,  // white at half exposure: 0.5
                                               // (0.25, 0, 0) over half of the background.
                                               137, 0, 137, 255};
    EXPECT_EQ(pixels.values, wanted);

    const auto picture = test::makePicture({.seed = 8, .crop = {10, 20, 40, 50}});
    const Pixels crop = writeAndRead(scratch / "crop.png", picture);
    EXPECT_EQ(crop.width, 30);
    EXPECT_EQ(crop.height, 30);
}

TEST_F(ImageFile, LightWithoutCoverageRaisesAlpha) {
    OutputOptions options;
    options.outcome = std::make_shared<DisplayOutcome>();
    const Pixels pixels = writeAndRead(
        scratch / "out.png", rowOfPixels({{0.18F, 0.18F, 0.18F, 0}, {0.1F, 0, 0, 0.5F}}), options);
    // In sRGB, 0.18 is byte 118. 0.1 with alpha 0.5 is straight 0.2, byte 124.
    EXPECT_EQ(pixels.values, (std::vector<std::uint16_t>{255, 255, 255, 118, 124, 0, 0, 128}));
    EXPECT_EQ(options.outcome->raised_pixels, 1U);
    options.background = {0, 0, 0, 1};
    const Pixels over =
        writeAndRead(scratch / "over.png", rowOfPixels({{0.18F, 0.18F, 0.18F, 0}}), options);
    EXPECT_EQ(over.values, (std::vector<std::uint16_t>{118, 118, 118, 255}));
    EXPECT_EQ(options.outcome->raised_pixels, 0U);
}

TEST_F(ImageFile, AutomaticExposureIsMeteredOnTheWholePicture) {
    OutputOptions options;
    options.automatic_exposure = true;
    options.outcome = std::make_shared<DisplayOutcome>();
    const std::vector<Rgba> bright(100, {100, 100, 100, 1});
    test::SyntheticPicture picture = rowOfPixels(bright);
    const Pixels pixels = writeAndRead(scratch / "out.png", picture, options);
    // The target is halfway between 0.18 and 1, in stops: √0.18 = 0.424, sRGB 174. The exposure is
    // rounded to tenths.
    EXPECT_NEAR(options.outcome->exposure, std::log2(0.424 / 100), 0.051);
    EXPECT_NEAR(pixels.values[0], 174, 4);
    // Parts of a picture are not metered, so that their exposures match.
    picture.plan.view.height = 2;
    writeAndRead(scratch / "part.png", picture, options);
    EXPECT_EQ(options.outcome->exposure, 0);
}

TEST_F(ImageFile, JpegIsOverBlackOrTheBackground) {
    const test::SyntheticPicture picture =
        rowOfPixels(std::vector<Rgba>(16, {0.25F, 0.25F, 0.25F, 0.5F}));
    const Pixels black = writeAndRead(scratch / "out.jpg", picture);
    ASSERT_EQ(black.channels, 3);
    for (const std::uint16_t value : black.values)
        EXPECT_NEAR(value, 137, 2);
    OutputOptions options;
    options.background = {0.5F, 0.5F, 0.5F, 1};
    const Pixels gray = writeAndRead(scratch / "out.JPEG", picture, options);
    for (const std::uint16_t value : gray.values)
        EXPECT_NEAR(value, 188, 2);
}

TEST_F(ImageFile, TiffHasSixteenBits) {
    const Pixels pixels = writeAndRead(scratch / "out.tiff",
                                       rowOfPixels({{0.25F, 0, 0.5F, 0.5F}, {0.001F, 0.5F, 1, 1}}));
    const auto encoded = [](float v) {
        return static_cast<std::uint16_t>(encodeSrgb(v) * 65535 + 0.5F);
    };
    const std::vector<std::uint16_t> wanted = {encoded(0.5F), 0,     65535, 32768, encoded(0.001F),
                                               encoded(0.5F), 65535, 65535};
    EXPECT_EQ(pixels.values, wanted);
}

TEST_F(ImageFile, SameInputSameBytesHoweverCut) {
    const auto picture = test::makePicture({.seed = 9, .width = 120, .height = 150});
    for (const char* name : {"a.png", "a.jpg", "a.tif"}) {
        std::vector<std::string> files;
        for (const auto& heights : {std::vector{1000}, {1}, {64, 3}}) {
            const auto sink = makeSink(scratch / name, {});
            test::writePicture(*sink, picture, heights);
            files.push_back(test::bytesOf(scratch / name));
        }
        EXPECT_TRUE(files[0] == files[1] && files[0] == files[2]) << name;
        const Pixels pixels = readBack(scratch / name);
        EXPECT_EQ(pixels.height, 150);
    }
}

TEST_F(ImageFile, AbandonedWritersLeaveNothing) {
    const auto picture = test::makePicture({.seed = 9});
    testing::internal::CaptureStderr();
    for (const char* name : {"a.exr", "a.png", "a.jpg", "a.tif"}) {
        const auto sink = makeSink(scratch / name, {});
        sink->begin(picture.plan);
        sink->write(test::cutRows(picture.image, 0, 30));
    }
    EXPECT_EQ(testing::internal::GetCapturedStderr(), "");
    EXPECT_TRUE(fs::is_empty(scratch.path()));
}

TEST_F(ImageFile, SaysWhatItIs) {
    OutputOptions options;
    options.provenance.version = "1";
    options.provenance.output_hash = "0123456789abcdef";
    for (const char* name : {"a.png", "a.jpg"}) {
        const std::string path = scratch / name;
        writeAndRead(path, rowOfPixels({{1, 1, 1, 1}}), options);
        const auto input = OIIO::ImageInput::open(path);
        ASSERT_TRUE(input) << OIIO::geterror();
        const OIIO::ImageSpec& spec = input->spec();
        EXPECT_EQ(spec.get_string_attribute("Software"), "peeler 1") << name;
        EXPECT_EQ(spec.get_string_attribute("oiio:ColorSpace"), "sRGB") << name;
        EXPECT_EQ(spec.get_string_attribute("ImageDescription"), outputHashText("0123456789abcdef"))
            << name;
        EXPECT_EQ(imageDescription(path), outputHashText("0123456789abcdef")) << name;
    }
}

TEST(Srgb, KnownValues) {
    EXPECT_EQ(encodeSrgb(0), 0);
    EXPECT_EQ(encodeSrgb(1), 1);
    EXPECT_EQ(encodeSrgb(-3), 0);
    EXPECT_EQ(encodeSrgb(7), 1);
    EXPECT_EQ(encodeSrgb(std::nanf("")), 0);
    EXPECT_NEAR(encodeSrgb(0.0031308F), 0.04045F, 1e-5);
    EXPECT_NEAR(encodeSrgb(0.18F), 0.46136F, 1e-4);
}

TEST(ToneMaps, CurvesAreWhatTheyClaim) {
    ASSERT_EQ(toneMaps().front().name, "neutral");
    for (const ToneMap& entry : toneMaps()) {
        SCOPED_TRACE(std::string(entry.name));
        float before = -1;
        // The tone map must be monotonic and keep greys grey.
        for (float v = 0; v <= 20; v += 0.125F) {
            const auto mapped = entry.map({v, v, v});
            EXPECT_NEAR(mapped[0], mapped[1], 2e-3F);
            EXPECT_NEAR(mapped[0], mapped[2], 2e-3F);
            EXPECT_GE(mapped[0], before - 1e-6F);
            before = mapped[0];
            EXPECT_TRUE(entry.name == "none" || mapped[0] <= 1.02F) << mapped[0];
        }
    }
    const auto map = [](std::string_view name, std::array<float, 3> color) {
        for (const ToneMap& entry : toneMaps()) {
            if (entry.name == name) return entry.map(color);
        }
        throw std::runtime_error("no such tone map");
    };
    // With "neutral", base colours below the shoulder lose only the 4 % Fresnel offset.
    const auto base = map("neutral", {0.5F, 0.3F, 0.2F});
    EXPECT_NEAR(base[0], 0.46F, 1e-6);
    EXPECT_NEAR(base[1], 0.26F, 1e-6);
    EXPECT_NEAR(base[2], 0.16F, 1e-6);
    // With "aces", the expected value of 18 % grey was computed by hand.
    EXPECT_NEAR(map("aces", {0.18F, 0.18F, 0.18F})[0], 0.1055F, 2e-3);
    EXPECT_EQ(map("none", {5, 0, -1}), (std::array<float, 3>{5, 0, -1}));
}

/// Returns the kind and hint of the Error that makeSink() throws.
std::string usageHint(const std::string& path, const OutputOptions& options) {
    try {
        makeSink(path, options);
    } catch (const Error& e) {
        EXPECT_EQ(e.kind(), ErrorKind::kUsage) << e.what();
        return e.hint();
    }
    ADD_FAILURE() << "nothing was thrown";
    return {};
}

TEST(Writers, ChoicesAreListedWhereAChoiceIsWrong) {
    OutputOptions options;
    EXPECT_EQ(
        usageHint("out.bmp", options),
        "choose one of: .exr, .png, .jpg, .jpeg, .tif, .tiff, .html, .htm, .safetensors, .npz");
    EXPECT_NE(usageHint("out", options).find(".exr"), std::string::npos);
    options.as = "ldi";
    EXPECT_EQ(usageHint("out.png", options),
              "write .exr, or use `as` composite, lari, world-tracing");
    options.as = "voxels";
    EXPECT_EQ(usageHint("out.exr", options),
              "choose one of: ldi, deep, composite, midpoint-depth, page, layers, arrays, dense, "
              "lari, world-tracing, xray");
    options.as = "";
    options.tone_map = "filmic";
    EXPECT_EQ(usageHint("out.png", options), "choose one of: neutral, none, aces");
}

TEST(Writers, ExtensionAndKindChooseTheFormat) {
    EXPECT_EQ(findOutputFormat("a/b.EXR", "").kind, "ldi");
    EXPECT_EQ(findOutputFormat("b.exr", "composite").kind, "composite");
    EXPECT_EQ(findOutputFormat("b.Png", "").kind, "composite");
    for (const OutputFormat& format : outputFormats()) {
        for (const std::string_view extension : format.extensions) {
            const std::string path = "x" + std::string(extension);
            EXPECT_EQ(&findOutputFormat(path, std::string(format.kind)), &format) << path;
        }
    }
}

}  // namespace
}  // namespace peeler
