// SPDX-License-Identifier: Apache-2.0
// Tests the memory for reading bands: no band exceeds its reader's stated maximum, and a budget
// reduces the band height.
#include "cmd/extract/band_memory.h"

#include <gtest/gtest.h>

#include <peeler/error.h>
#include "core/base/process_memory.h"
#include "formats/exr/exr_readers.h"
#include "formats/exr/exr_writers.h"
#include "formats/exr/synthetic_image.h"
#include "formats/layered/opened_picture.h"
#include "support/test_support.h"

namespace peeler {
namespace {

using cmd::bandBytesWithin;
using cmd::bandMemory;
using cmd::BandUse;

constexpr std::uint64_t kMegabyte = std::uint64_t{1} << 20;

/// A picture of 1000 × 1000 pixels with stated sizes. The test must never read it.
class Promised final : public LayeredInput {
  public:
    Promised() { info_.plan.view.crop = {0, 0, 1000, 1000}; }
    const ExrInfo& info() const override { return info_; }
    void read(const Window&, LayeredImage&) override { FAIL() << "nothing is to be read"; }
    void readComposite(const Window&, CompositeImage&) override { FAIL(); }
    int rowsFor(std::uint64_t bytes) const override {
        return static_cast<int>(std::clamp<std::uint64_t>(bytes / kRowBytes, 1, 1000));
    }
    BandRead mostOf(int rows) const override {
        const auto count = static_cast<std::uint64_t>(rows);
        return {count * 2000, count * kRowBytes, false};
    }

    static constexpr std::uint64_t kRowBytes = kMegabyte;

  private:
    ExrInfo info_;
};

BandUse plainUse(int) {
    return {.list_bytes = 12, .made = {.fixed = kMegabyte, .fragment = 100}, .layers = 10};
}

TEST(BandMemory, CountsWhatIsThereAtATime) {
    const Promised input;
    const auto use = [](std::uint64_t fragment_bytes) {
        return [fragment_bytes](int) {
            return BandUse{.made = {.fragment = fragment_bytes}, .layers = 10};
        };
    };
    const std::uint64_t nothing = bandMemory(input, 10, use(0));
    EXPECT_EQ(bandMemory(input, 10, use(1)) - nothing, 20'000U);
    // With a single band, the input is freed before the output is made.
    EXPECT_EQ(bandMemory(input, 1000, use(1)), bandMemory(input, 1000, use(0)));
    // With one layer, each pixel has at most one fragment.
    const auto one = [](int) { return BandUse{.made = {.fragment = 1}, .layers = 1}; };
    EXPECT_EQ(bandMemory(input, 10, one) - nothing, 10'000U);
    DepthComplexity counted(input.info().plan.view.crop);
    counted.addRow(0, 5, std::vector<std::uint32_t>(1000, 1));
    EXPECT_EQ(bandMemory(input, 10, use(1), &counted) - bandMemory(input, 10, use(0), &counted),
              1000U);
}

TEST(BandMemory, KeepsToABudget) {
    const Promised input;
    const std::uint64_t most = 64 * kMegabyte;
    EXPECT_EQ(bandBytesWithin({}, input, most, plainUse), most);
    const std::uint64_t used = residentBytes();
    EXPECT_EQ(bandBytesWithin(used + 1000 * kMegabyte, input, most, plainUse), most);
    const std::uint64_t less = bandBytesWithin(used + 40 * kMegabyte, input, most, plainUse);
    EXPECT_LT(less, most);
    EXPECT_GT(less, 4 * kMegabyte);
    try {
        bandBytesWithin(kMegabyte, input, most, plainUse);
        ADD_FAILURE() << "it is over the budget";
    } catch (const Error& error) {
        EXPECT_EQ(error.kind(), ErrorKind::kMemory);
        EXPECT_NE(error.hint().find("give at least"), std::string::npos) << error.hint();
    }
}

/// Returns the highest number of fragments in any band.
std::uint64_t mostFragments(LayeredInput& input, int rows) {
    const Window& crop = input.info().plan.view.crop;
    std::uint64_t most = 0;
    LayeredImage band;
    for (int y = crop.y0; y < crop.y1; y += rows) {
        input.read({crop.x0, y, crop.x1, std::min(y + rows, crop.y1)}, band);
        most = std::max<std::uint64_t>(most, band.fragments());
    }
    return most;
}

TEST(BandMemory, NoBandHasMoreThanItsReaderSays) {
    const test::ScratchDir scratch;
    const test::SyntheticPicture picture = test::makePicture({});
    const std::filesystem::path layered = scratch / "layered.exr", deep = scratch / "deep.exr";
    OutputOptions options;
    options.provenance.version = "1.2.3";  // the reader trusts headers written by peeler
    ExrLdiWriter layered_writer(layered, options);
    test::writePicture(layered_writer, picture, {1 << 20});
    ExrDeepWriter deep_writer(deep, options);
    test::writePicture(deep_writer, picture, {1 << 20});
    const int height = picture.image.window.height();
    const auto of_samples = openLayered(deep);
    LayeredInput& samples = *of_samples;
    for (const int rows : {1, 3, 16, height}) {
        ExrLdiReader layers(layered);
        EXPECT_GE(layers.mostOf(rows).fragments, mostFragments(layers, rows)) << rows;
        EXPECT_LE(layers.mostOf(rows).fragments, picture.image.fragments()) << rows;
        EXPECT_GT(layers.mostOf(rows).bytes, 0U);
        EXPECT_GE(samples.mostOf(rows).fragments, mostFragments(samples, rows)) << rows;
        EXPECT_TRUE(samples.mostOf(rows).counted);
    }
    EXPECT_EQ(samples.mostOf(height).fragments, picture.image.fragments());
    EXPECT_EQ(samples.mostOf(1).fragments, mostFragments(samples, 1));
}

}  // namespace
}  // namespace peeler
