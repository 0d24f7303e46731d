// SPDX-License-Identifier: Apache-2.0
// Tests the verbs with valid and invalid OpenEXR files from other programs. Compares deep samples
// with those that OpenEXR and OpenImageIO read.
#include <OpenImageIO/imagebuf.h>
#include <OpenImageIO/imagebufalgo.h>
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <fstream>
#include <random>
#include <string>

#include <peeler/error.h>
#include "cmd/verbs.h"
#include "formats/exr/deep_file.h"
#include "formats/layered/opened_picture.h"
#include "support/test_support.h"

namespace peeler::test {
namespace {

namespace fs = std::filesystem;

constexpr const char* kFolder = "exr-conformance";

struct Sample {
    const char* name;
    int exit_code;
    bool deep = false;
};
constexpr Sample kSamples[] = {
    {"11.deep.exr", 0, true},
    {"Balls.exr", 0, true},
    {"Trunks.exr", 0, true},
    {"channelTestMultiViewPartPerView.exr", 0},
    {"channelTestPartPerLayer.exr", 0},
    {"composited.exr", 0},
    {"deepFloatPoints.exr", 0},  // flat, despite its name
    {"invalid_shared_attrs_multipart.exr", 3},
    {"multipart.0001.exr", 0},
    {"objectid.deep.exr", 0, true},
    {"scanline_with_deepscanline_type.exr", 3},
    {"tinydeep.exr", 0, true},
};

bool known(const fs::path& file) {
    return std::any_of(std::begin(kSamples), std::end(kSamples),
                       [&](const Sample& sample) { return file.filename() == sample.name; });
}

TEST(ExrConformance, TheTableNamesEveryFile) {
    PEELER_REQUIRE_ASSETS(assets);
    for (const auto& entry : fs::directory_iterator(assets / kFolder))
        EXPECT_TRUE(known(entry.path())) << entry.path();
}

TEST(ExrConformance, ValidFilesAreReadAndInvalidOnesRefused) {
    PEELER_REQUIRE_ASSETS(assets);
    const ScratchDir scratch;
    const auto exists = [](const char* name) {
        const auto verbs = cmd::verbs();
        return std::any_of(verbs.begin(), verbs.end(),
                           [&](const cmd::Verb& verb) { return verb.name == name; });
    };
    for (const Sample& sample : kSamples) {
        const std::string file = (assets / kFolder / sample.name).string();
        const std::string out = (scratch / "out.exr").string();
        for (const std::vector<std::string>& command :
             {std::vector<std::string>{"info", file},
              {"flatten", file, "-o", out},
              {"convert", file, "-o", out, "--as", "deep"},
              {"verify", file}}) {
            if (!exists(command.front().c_str())) continue;
            const Outcome result = runPeeler(command);
            EXPECT_EQ(result.exit_code, sample.exit_code)
                << command.front() << ' ' << sample.name << ": " << result.err;
            const bool error = result.err.find("peeler: error:") != std::string::npos;
            EXPECT_EQ(error, sample.exit_code != 0) << sample.name << ": " << result.err;
        }
    }
}

/// Returns the R, G, B and A of a pixel; 0 outside the image.
std::array<float, 4> colorAt(const OIIO::ImageBuf& image, int x, int y) {
    std::array<float, 4> color{};
    const char* names[] = {"R", "G", "B", "A"};
    for (std::size_t c = 0; c < 4; ++c) {
        const int channel = image.spec().channelindex(names[c]);
        if (channel >= 0) color[c] = image.getchannel(x, y, 0, channel);
    }
    return color;
}

TEST(ExrConformance, DeepFilesHoldWhatOpenExrFindsAndFlattenAsInOpenImageIo) {
    PEELER_REQUIRE_ASSETS(assets);
    for (const Sample& sample : kSamples) {
        if (!sample.deep) continue;
        SCOPED_TRACE(sample.name);
        const std::string path = (assets / kFolder / sample.name).string();
        const auto reader = openLayered(path);
        const Window crop = reader->info().plan.view.crop;
        LayeredImage image;
        reader->read(crop, image);

        Imf::MultiPartInputFile file(path.c_str());
        const DeepPart part = readDeepPart(file, 0);
        // The reader also returns the pixels of the display window that are outside the data
        // window.
        const Window data{part.window.min.x, part.window.min.y, part.window.max.x + 1,
                          part.window.max.y + 1};
        ASSERT_EQ(intersect(data, crop), data);
        std::size_t pixel = 0, stored = 0;
        for (int y = crop.y0; y < crop.y1; ++y) {
            for (int x = crop.x0; x < crop.x1; ++x, ++pixel) {
                if (x < data.x0 || x >= data.x1 || y < data.y0 || y >= data.y1) {
                    ASSERT_EQ(image.count(pixel), 0U);
                    continue;
                }
                ASSERT_EQ(image.count(pixel), part.counts[stored]);
                std::vector<double> depths = part.values.at("Z")[stored++];
                std::sort(depths.begin(), depths.end());
                for (std::uint32_t k = 0; k < image.count(pixel); ++k)
                    ASSERT_EQ(static_cast<double>(image.z[image.offsets[pixel] + k]), depths[k]);
            }
        }
        ASSERT_EQ(stored, part.pixels());

        OIIO::ImageBuf deep(path), flat;
        ASSERT_TRUE(OIIO::ImageBufAlgo::flatten(flat, deep)) << flat.geterror();
        CompositeImage composite;
        compositeOver(image, {}, composite);
        std::size_t p = 0;
        for (int y = crop.y0; y < crop.y1; ++y) {
            for (int x = crop.x0; x < crop.x1; ++x, ++p) {
                const std::array<float, 4> wanted = colorAt(flat, x, y);
                for (std::size_t c = 0; c < 4; ++c) {
                    // OpenImageIO rounds to half after every sample.
                    const float bound = 2e-3F * std::max(1.0F, std::abs(wanted[c]));
                    ASSERT_NEAR(composite.rgba[p][c], wanted[c], bound) << x << ',' << y;
                }
            }
        }
    }
}

TEST(ExrConformance, DamagedFilesAreErrorsNotCrashes) {
    PEELER_REQUIRE_ASSETS(assets);
    const ScratchDir scratch;
    constexpr std::uint32_t kSeed = 17;
    constexpr int kTurns = 40;
    std::mt19937 random(kSeed);
    int refused = 0;
    for (const Sample& sample : kSamples) {
        const std::string good = bytesOf(assets / kFolder / sample.name);
        for (int turn = 0; turn < kTurns; ++turn) {
            std::string bad = good;
            if (turn % 4 == 0) {
                bad.resize(random() % good.size());
            } else {
                const std::size_t range =
                    turn % 4 < 3 ? std::min<std::size_t>(3000, bad.size()) : bad.size();
                for (int n = 0; n < 3; ++n)
                    bad[random() % range] = static_cast<char>(random());
            }
            const fs::path path = scratch / "bad.exr";
            std::ofstream(path, std::ios::binary) << bad;
            try {
                const auto reader = openLayered(path);
                LayeredImage image;
                const Window crop = reader->info().plan.view.crop;
                reader->read({crop.x0, crop.y0, crop.x1, std::min(crop.y1, crop.y0 + 32)}, image);
            } catch (const Error& e) {
                EXPECT_EQ(e.kind(), ErrorKind::kInput) << "seed " << kSeed << ", " << sample.name
                                                       << " turn " << turn << ": " << e.what();
                ++refused;
            }
        }
    }
    EXPECT_GT(refused, 100);
}

}  // namespace
}  // namespace peeler::test
