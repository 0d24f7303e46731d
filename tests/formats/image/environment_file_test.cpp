// SPDX-License-Identifier: Apache-2.0
#include "formats/image/environment_file.h"

#include <OpenEXR/ImfEnvmap.h>
#include <OpenEXR/ImfStandardAttributes.h>
#include <OpenImageIO/imageio.h>
#include <gtest/gtest.h>

#include <fstream>
#include <functional>
#include <limits>

#include <peeler/error.h>
#include "formats/exr/flat_file.h"
#include "support/test_support.h"

namespace peeler::test {
namespace {

/// Writes `values`, three or four per pixel, with OpenImageIO. Returns the path.
std::string writeFloats(const ScratchDir& folder, const std::string& name, int width, int height,
                        const std::vector<float>& values, int channels = 3) {
    const std::string path = folder / name;
    const auto file = OIIO::ImageOutput::create(path);
    EXPECT_TRUE(file &&
                file->open(path, OIIO::ImageSpec(width, height, channels, OIIO::TypeDesc::FLOAT)));
    EXPECT_TRUE(file->write_image(OIIO::TypeDesc::FLOAT, values.data()) && file->close());
    return path;
}

struct Sky {
    Environment environment;
    std::vector<Text> warnings;
};
Sky skyOf(const std::string& path, const EnvironmentLimits& limits = {}, bool strict = false) {
    ReadWarnings warnings(strict, path);
    Environment environment = readEnvironment(path, warnings, limits);
    return {std::move(environment), warnings.take()};
}

Error environmentError(const std::string& path, const EnvironmentLimits& limits = {},
                       bool strict = false) {
    try {
        skyOf(path, limits, strict);
    } catch (const Error& error) {
        return error;
    }
    ADD_FAILURE() << path << " was read without an error";
    return Error(ErrorKind::kInternal, "none");
}

TEST(EnvironmentFile, HoldsLinearLightInBothFormats) {
    const ScratchDir folder;
    const std::vector<float> values{1, 0.5F, 0.25F, 300, 2, 0, 0, 0, 0, 0.125F, 4, 1};
    for (const char* name : {"sky.hdr", "sky.exr"}) {
        const Environment e = skyOf(writeFloats(folder, name, 2, 2, values)).environment;
        EXPECT_EQ(e.width, 2);
        EXPECT_EQ(e.height, 2);
        for (std::size_t i = 0; i < values.size(); ++i)
            EXPECT_NEAR(e.radiance[i / 3][static_cast<int>(i % 3)], values[i],
                        0.01 * double(values[i / 3 * 3] + values[i / 3 * 3 + 1]))
                << name;
    }
}

TEST(EnvironmentFile, IsToldByItsBytesNotByItsName) {
    const ScratchDir folder;
    const std::string path = writeFloats(folder, "sky.hdr", 1, 1, {1, 2, 3});
    std::filesystem::rename(path, folder / "sky.png");
    EXPECT_EQ(skyOf(folder / "sky.png").environment.width, 1);
}

TEST(EnvironmentFile, HasAHashOfItsPixels) {
    const ScratchDir folder;
    const auto hash = [&](float value) {
        return skyOf(writeFloats(folder, "a.exr", 1, 1, {1, value, 3})).environment.content_hash;
    };
    EXPECT_EQ(hash(2), hash(2));
    EXPECT_NE(hash(2), hash(2.5F));
}

TEST(EnvironmentFile, NegativeLightIsNone) {
    const ScratchDir folder;
    const Sky sky = skyOf(writeFloats(folder, "a.exr", 1, 1, {-1, 2, 3}));
    EXPECT_EQ(sky.environment.radiance[0], glm::vec3(0, 2, 3));
    EXPECT_EQ(sky.warnings.size(), 1U);
    EXPECT_TRUE(skyOf(writeFloats(folder, "a.exr", 1, 1, {-0.001F, 2, 3})).warnings.empty());
}

TEST(EnvironmentFile, WithoutFiniteNumbersIsRefusedWithThePixel) {
    const ScratchDir folder;
    for (const float bad :
         {std::numeric_limits<float>::infinity(), std::numeric_limits<float>::quiet_NaN()}) {
        const std::string path = writeFloats(folder, "a.exr", 2, 1, {1, 2, 3, 4, bad, 6});
        const Error error = environmentError(path);
        EXPECT_EQ(error.kind(), ErrorKind::kInput);
        EXPECT_EQ(error.where(), path);
        EXPECT_NE(std::string(error.what()).find("(1, 0)"), std::string::npos) << error.what();
    }
}

TEST(EnvironmentFile, OfOtherKindsIsRefused) {
    const ScratchDir folder;
    const std::string png = writeFloats(folder, "a.png", 1, 1, {1, 1, 1});
    EXPECT_EQ(environmentError(png).kind(), ErrorKind::kInput);
    EXPECT_NE(environmentError(png).hint().find(".hdr"), std::string::npos);
    EXPECT_EQ(environmentError(folder / "missing.hdr").kind(), ErrorKind::kInput);
    EXPECT_EQ(environmentError(folder.path()).kind(), ErrorKind::kInput);
    EXPECT_EQ(environmentError("/dev/null").kind(), ErrorKind::kInput);
}

TEST(EnvironmentFile, BeyondTheLimitsIsRefusedBeforeItIsDecoded) {
    const ScratchDir folder;
    std::ofstream(folder / "huge.hdr")
        << "#?RADIANCE\nFORMAT=32-bit_rle_rgbe\n\n-Y 60000 +X 60000\n";
    EXPECT_EQ(environmentError(folder / "huge.hdr").kind(), ErrorKind::kInput);
    const std::string small = writeFloats(folder, "small.exr", 4, 2, std::vector<float>(24, 1));
    EXPECT_EQ(environmentError(small, {3, 1 << 20}).kind(), ErrorKind::kInput);
    EXPECT_EQ(environmentError(small, {4, 127}).kind(), ErrorKind::kInput);
    EXPECT_NO_THROW(skyOf(small, {4, 128}));
}

TEST(EnvironmentFile, CutShortIsRefused) {
    const ScratchDir folder;
    for (const char* name : {"a.hdr", "a.exr"}) {
        const std::string path =
            writeFloats(folder, name, 64, 32, std::vector<float>(64 * 32 * 3, 0.7F));
        const std::string bytes = bytesOf(path);
        for (const std::size_t kept : {std::size_t{12}, bytes.size() / 2}) {
            std::ofstream(path, std::ios::binary) << bytes.substr(0, kept);
            EXPECT_EQ(environmentError(path).kind(), ErrorKind::kInput) << name << ", " << kept;
        }
    }
}

/// Writes a Radiance file with these bytes, four per pixel. Returns the path.
std::string writeRadiance(const ScratchDir& folder, const std::string& header,
                          const std::string& resolution, const std::string& bytes) {
    const std::string path = folder / "sky.hdr";
    std::ofstream(path, std::ios::binary)
        << "#?RADIANCE\nFORMAT=32-bit_rle_rgbe\n" + header + '\n' + resolution + '\n' + bytes;
    return path;
}

/// Returns a grey pixel of brightness n / 128.
std::string grey(int n) {
    return std::string(3, static_cast<char>(n)) + '\x81';
}

TEST(EnvironmentFile, MayHaveEachOfTheEightOrientations) {
    constexpr int kWidth = 4, kHeight = 2;
    for (const bool rows_first : {true, false})
        for (const char x_sign : {'+', '-'})
            for (const char y_sign : {'+', '-'}) {
                // X grows to the right, and Y upward. The first axis of the resolution is the outer
                // loop.
                std::string bytes;
                for (int a = 0; a < (rows_first ? kHeight : kWidth); ++a)
                    for (int b = 0; b < (rows_first ? kWidth : kHeight); ++b) {
                        const int along_x = rows_first ? b : a, along_y = rows_first ? a : b;
                        const int x = x_sign == '+' ? along_x : kWidth - 1 - along_x;
                        const int y = y_sign == '-' ? along_y : kHeight - 1 - along_y;
                        bytes += grey(128 + 8 * y + x);
                    }
                const std::string x_axis = std::string(1, x_sign) + "X 4",
                                  y_axis = std::string(1, y_sign) + "Y 2";
                const std::string resolution =
                    rows_first ? y_axis + ' ' + x_axis : x_axis + ' ' + y_axis;
                SCOPED_TRACE(resolution);
                const ScratchDir folder;
                const Sky sky = skyOf(writeRadiance(folder, "", resolution, bytes));
                ASSERT_EQ(sky.environment.width, kWidth);
                ASSERT_EQ(sky.environment.height, kHeight);
                EXPECT_TRUE(sky.warnings.empty());
                for (int y = 0; y < kHeight; ++y)
                    for (int x = 0; x < kWidth; ++x)
                        EXPECT_NEAR(
                            sky.environment.radiance[static_cast<std::size_t>(kWidth * y + x)].x,
                            (128 + 8 * y + x) / 128.0, 1e-6)
                            << x << ' ' << y;
            }
}

TEST(EnvironmentFile, WarnsOfSettingsThatHaveNoEffect) {
    const ScratchDir folder;
    for (const char* quiet :
         {"", "EXPOSURE= 1.0000000\n", "GAMMA=1\n", "COLORCORR=1 1 1\n",
          "PRIMARIES=0.6400 0.3300 0.2900 0.6000 0.1500 0.0600 0.3333 0.3333\n",
          "PRIMARIES=0.64 0.33 0.3 0.6 0.15 0.06 0.3127 0.329\n", "VIEW=-vtv\n# EXPOSURE=2\n"})
        EXPECT_TRUE(skyOf(writeRadiance(folder, quiet, "-Y 1 +X 2", grey(128) + grey(128)))
                        .warnings.empty())
            << quiet;
    for (const char* loud : {"EXPOSURE=2\n", "GAMMA=2.2\n", "COLORCORR=1 2 1\n",
                             "PRIMARIES=0.7347 0.2653 0 1 0.0001 -0.077 0.3217 0.3377\n"}) {
        const std::string path = writeRadiance(folder, loud, "-Y 1 +X 2", grey(128) + grey(128));
        const Sky sky = skyOf(path);
        ASSERT_EQ(sky.warnings.size(), 1U) << loud;
        EXPECT_TRUE(contains(sky.warnings[0], path)) << sky.warnings[0];
        EXPECT_TRUE(contains(sky.warnings[0], std::string(loud, 4))) << sky.warnings[0];
        EXPECT_EQ(sky.environment.radiance[0], glm::vec3(1));
        EXPECT_EQ(environmentError(path, {}, true).where(), path);
    }
}

/// Writes a black sky of this size. Returns the path.
std::string writeExr(const ScratchDir& folder, int width, int height,
                     const std::function<void(Imf::Header&)>& change = {}, std::size_t parts = 1) {
    const std::string path = folder / "sky.exr";
    const Imath::Box2i window{{0, 0}, {width - 1, height - 1}};
    writeBlackFile(path, window, window, change, parts);
    return path;
}

TEST(EnvironmentFile, IsRefusedIfItIsACubeMap) {
    const ScratchDir folder;
    EXPECT_TRUE(skyOf(writeExr(folder, 2, 1, [](Imf::Header& header) {
                    Imf::addEnvmap(header, Imf::ENVMAP_LATLONG);
                })).warnings.empty());
    const Error error = environmentError(writeExr(
        folder, 2, 12, [](Imf::Header& header) { Imf::addEnvmap(header, Imf::ENVMAP_CUBE); }));
    EXPECT_TRUE(contains(error.what(), "cube map")) << error.what();
    EXPECT_TRUE(contains(error.hint(), "exrenvmap")) << error.hint();
}

TEST(EnvironmentFile, WarnsOfOtherPrimariesAndParts) {
    const ScratchDir folder;
    const auto with = [](const Imf::Chromaticities& primaries) {
        return [=](Imf::Header& header) { Imf::addChromaticities(header, primaries); };
    };
    EXPECT_TRUE(skyOf(writeExr(folder, 2, 1, with({}))).warnings.empty());
    const Sky sky = skyOf(writeExr(
        folder, 2, 1, with({{0.7347F, 0.2653F}, {0, 1}, {0.0001F, -0.077F}, {0.3217F, 0.3377F}})));
    ASSERT_EQ(sky.warnings.size(), 1U);
    EXPECT_TRUE(contains(sky.warnings[0], "primaries")) << sky.warnings[0];
    const Sky two = skyOf(writeExr(folder, 2, 1, {}, 2));
    ASSERT_EQ(two.warnings.size(), 1U);
    EXPECT_TRUE(contains(two.warnings[0], "it has 2 parts")) << two.warnings[0];
}

TEST(EnvironmentFile, WarnsOfPicturesThatAreNotTwiceAsWideAsHigh) {
    const ScratchDir folder;
    for (const auto& [width, height] : {std::pair(64, 32), {1, 1}, {63, 32}, {64, 33}})
        EXPECT_TRUE(skyOf(writeExr(folder, width, height)).warnings.empty());
    // These are the sizes of a light probe and of cube crosses.
    for (const auto& [width, height] : {std::pair(32, 32), {24, 32}, {32, 24}, {8, 48}})
        EXPECT_EQ(skyOf(writeExr(folder, width, height)).warnings.size(), 1U);
}

}  // namespace
}  // namespace peeler::test
