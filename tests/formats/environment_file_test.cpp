// SPDX-License-Identifier: Apache-2.0
// Environments from files, whole and damaged.
#include "formats/image/environment_file.h"

#include <OpenImageIO/imageio.h>
#include <gtest/gtest.h>

#include <fstream>
#include <limits>

#include "core/base/error.h"
#include "support/test_support.h"

namespace peeler::test {
namespace {

/// Writes `values`, three or four a pixel, with OpenImageIO.
std::string writeFloats(const ScratchDir& folder, const std::string& name, int width, int height,
                        const std::vector<float>& values, int channels = 3) {
    const std::string path = folder / name;
    const auto file = OIIO::ImageOutput::create(path);
    EXPECT_TRUE(file &&
                file->open(path, OIIO::ImageSpec(width, height, channels, OIIO::TypeDesc::FLOAT)));
    EXPECT_TRUE(file->write_image(OIIO::TypeDesc::FLOAT, values.data()) && file->close());
    return path;
}

Error environmentError(const std::string& path, const EnvironmentLimits& limits = {}) {
    try {
        readEnvironment(path, limits);
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
        const Environment e = readEnvironment(writeFloats(folder, name, 2, 2, values));
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
    EXPECT_EQ(readEnvironment(folder / "sky.png").width, 1);
}

TEST(EnvironmentFile, HasAHashOfItsPixels) {
    const ScratchDir folder;
    const auto hash = [&](float value) {
        return readEnvironment(writeFloats(folder, "a.exr", 1, 1, {1, value, 3})).content_hash;
    };
    EXPECT_EQ(hash(2), hash(2));
    EXPECT_NE(hash(2), hash(2.5F));
}

TEST(EnvironmentFile, NegativeLightIsNone) {
    const ScratchDir folder;
    const Environment e = readEnvironment(writeFloats(folder, "a.exr", 1, 1, {-1, 2, 3}));
    EXPECT_EQ(e.radiance[0], glm::vec3(0, 2, 3));
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
    EXPECT_NO_THROW(readEnvironment(small, {4, 128}));
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

}  // namespace
}  // namespace peeler::test
