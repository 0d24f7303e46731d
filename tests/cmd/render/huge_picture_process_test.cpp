// SPDX-License-Identifier: Apache-2.0
// Tests pictures larger than any driver's viewport, rendered in little memory and read by
// OpenImageIO.
#include <OpenImageIO/imageio.h>
#include <gtest/gtest.h>

#include <cstdio>
#include <filesystem>
#include <limits>
#include <nlohmann/json.hpp>
#include <vector>

#include "support/test_support.h"

namespace peeler::test {
namespace {

namespace fs = std::filesystem;

struct Picture {
    int width, height;
    /// The upper left corner of the compared part, which crosses raster tiles (4096) and chunks.
    int left, top;
    const char* target;  ///< camera target, which puts the model in the compared part
    const char* memory;
    std::uint64_t peak;   ///< limit of the process's memory, in bytes
    std::uintmax_t disk;  ///< free disk space required, in bytes
};
constexpr int kPartWidth = 40, kPartHeight = 24;

/// A picture wider than 32768 pixels, the maximum of all drivers.
const Picture kHugePicture = {40000,     20000, 20470,      10228,
                              "0,0.1,0", "2G",  2000000000, std::uintmax_t{3} << 30};
/// The picture of the short run: two raster tiles wide and high, with the model at their common
/// corner. The memory limit is less than the whole picture would need.
const Picture kLargePicture = {8200,      4200,   4080,      4084,
                               "0,0.8,0", "400M", 400000000, std::uintmax_t{100} << 20};

using Pixels = std::vector<float>;

/// Returns R, G, B, A and Z of the part for each subimage that contains it. Pixels outside the data
/// window are empty.
std::vector<Pixels> partOf(const fs::path& file, const Picture& picture) {
    const auto input = OIIO::ImageInput::open(file.string());
    EXPECT_TRUE(input) << OIIO::geterror();
    std::vector<Pixels> images;
    for (int s = 0; input && input->seek_subimage(s, 0); ++s) {
        const OIIO::ImageSpec spec = input->spec();
        EXPECT_EQ(spec.full_width, picture.width);
        EXPECT_EQ(spec.full_height, picture.height);
        Pixels pixels(static_cast<std::size_t>(kPartWidth * kPartHeight * spec.nchannels));
        Pixels row(static_cast<std::size_t>(spec.width * spec.nchannels));
        const auto channels = static_cast<std::size_t>(spec.nchannels);
        for (std::size_t i = 0; i < pixels.size(); ++i)
            if (spec.channelnames[i % channels] == "Z")
                pixels[i] = std::numeric_limits<float>::infinity();
        for (int y = picture.top; y < picture.top + kPartHeight; ++y) {
            if (y < spec.y || y >= spec.y + spec.height) continue;
            EXPECT_TRUE(input->read_scanline(y, 0, OIIO::TypeDesc::FLOAT, row.data()))
                << input->geterror();
            for (int x = picture.left; x < picture.left + kPartWidth; ++x) {
                if (x < spec.x || x >= spec.x + spec.width) continue;
                const auto from = static_cast<std::size_t>(x - spec.x) * channels;
                const auto to =
                    static_cast<std::size_t>((y - picture.top) * kPartWidth + x - picture.left) *
                    channels;
                for (std::size_t c = 0; c < channels; ++c)
                    pixels[to + c] = row[from + c];
            }
        }
        images.push_back(std::move(pixels));
    }
    return images;
}

TEST(HugePicture, IsRenderedInBandsAndTilesUnderItsBudget) {
    if (kShadowMemory) GTEST_SKIP() << "its memory is not the product's";
    const Picture& picture = exhaustive() ? kHugePicture : kLargePicture;
    const ScratchDir scratch;
    if (fs::space(scratch.path()).available < picture.disk)
        GTEST_SKIP() << "less than " << (picture.disk >> 20) << " MB are free in "
                     << scratch.path();
    const fs::path scene = sourceDir() / "examples" / "scenes" / "engine.glb";
    const std::string size = std::to_string(picture.width) + "x" + std::to_string(picture.height);
    const auto render = [&](const std::string& name, const std::vector<std::string>& more) {
        // The camera is so far away that the time depends only on the number of pixels.
        std::vector<std::string> all{"render", scene.string(), "-o",       scratch / name,
                                     "--eye",  "0.6,0.5,1.8",  "--target", picture.target,
                                     "--json", "--size",       size};
        all.insert(all.end(), more.begin(), more.end());
        return runPeelerProcess(all);
    };
    const CommandResult huge = render("huge.exr", {"--memory", picture.memory});
    ASSERT_EQ(huge.exit_code, 0) << huge.err;
    const auto told = nlohmann::json::parse(huge.out);
    std::printf("%s layers, %s fragments, %.0f MB file, peak of resident memory %.0f MB\n",
                told.at("layers").dump().c_str(), told.at("fragmentsStored").dump().c_str(),
                told.at("bytes").get<double>() * 1e-6,
                static_cast<double>(huge.peak_memory) * 1e-6);
    EXPECT_GE(told.at("layers"), 3);
    EXPECT_LT(huge.peak_memory, picture.peak);

    // The part, read by OpenImageIO, must equal the same part rendered alone.
    const std::vector<Pixels> whole = partOf(scratch / "huge.exr", picture);
    EXPECT_EQ(whole.size(), told.at("layers").get<std::size_t>() + 1);
    const std::string crop = std::to_string(picture.left) + "," + std::to_string(picture.top) +
                             "," + std::to_string(kPartWidth) + "," + std::to_string(kPartHeight);
    ASSERT_EQ(render("part.exr", {"--crop", crop}).exit_code, 0);
    const std::vector<Pixels> part = partOf(scratch / "part.exr", picture);
    ASSERT_GE(part.size(), 3U) << "the part shows too little to compare";
    for (std::size_t i = 0; i < part.size(); ++i)
        EXPECT_EQ(part[i], whole[i]) << "subimage " << i;
}

}  // namespace
}  // namespace peeler::test
