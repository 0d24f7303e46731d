// SPDX-License-Identifier: Apache-2.0
#include "core/fragments/bands.h"
#include "core/base/process_memory.h"

#include <gtest/gtest.h>

#include <peeler/error.h>

namespace peeler {
namespace {

TEST(Bands, CoverTheCropWithoutGapsAndWithinTheLimits) {
    const Window crop{10, 100, 60, 400};
    const auto row = [](int y) { return static_cast<std::uint64_t>(y % 7) * 30; };
    const BandLimits limits{1000, 50 * 20};
    int next = crop.y0;
    for (const Window& band : cutBands(crop, limits, row)) {
        EXPECT_EQ(band.x0, crop.x0);
        EXPECT_EQ(band.x1, crop.x1);
        EXPECT_EQ(band.y0, next);
        EXPECT_LE(band.height(), 20);
        std::uint64_t fragments = 0;
        for (int y = band.y0; y < band.y1; ++y)
            fragments += row(y);
        EXPECT_LE(fragments, limits.fragments);
        next = band.y1;
    }
    EXPECT_EQ(next, crop.y1);
}

TEST(Bands, ARowThatDoesNotFitIsAMemoryErrorThatNamesIt) {
    try {
        cutBands({0, 0, 10, 10}, {100, 1000}, [](int y) { return y == 7 ? 101U : 1U; });
        FAIL();
    } catch (const Error& error) {
        EXPECT_EQ(error.kind(), ErrorKind::kMemory);
        EXPECT_EQ(error.where(), "row 7");
    }
}

TEST(Bands, ARowMayHoldMoreThanABandOfSeveral) {
    const auto row = [](int y) { return y == 1 ? 250U : 60U; };
    const auto bands = cutBands({0, 0, 10, 4}, {100, 1000, 250}, row);
    ASSERT_EQ(bands.size(), 4U);
    EXPECT_EQ(bands[1], (Window{0, 1, 10, 2}));
    BandCosts costs;
    costs.band_bytes = 1 << 20;
    costs.use.fragment = 28;
    costs.largest_array_bytes = 8;
    costs.use.pixel = 32;
    costs.storage_block_bytes = 128ULL << 20;
    EXPECT_EQ(bandLimits(0, 0, costs).row_fragments, (128ULL << 20) / 8) << "no budget";
    const std::uint64_t gigabyte = 1ULL << 30;
    EXPECT_LE(bandLimits(gigabyte, gigabyte / 2, costs).row_fragments * 28, gigabyte / 2);
}

TEST(Bands, ASinkTakesWhatItSays) {
    class Keeper final : public Sink {
        void begin(const Plan&) override {}
        void write(LayeredImage&&) override {}
        void finish() override {}
        SinkMemory memory(const Plan&) const override {
            return {.rows = 2, .bytes = 100, .pixel_bytes = 8, .fragment_bytes = 12, .bands = 1};
        }
    };
    Plan plan;
    plan.view.crop = {0, 0, 10, 10};
    const MemoryUse use = sinkUse(Keeper(), plan, 20, [](int rows) { return 30ULL * rows; });
    // The sink may hold two copies of its 2 rows. Each copy has 20 pixels and at most 60 fragments.
    EXPECT_EQ(use.fixed, 2 * (60 * 20 + 20 * (kBandPixelBytes + 8)) + 100);
    EXPECT_EQ(use.pixel, 8 + sizeof(std::uint32_t));
    EXPECT_EQ(use.fragment, 12U + 20U);
    EXPECT_EQ(use.of(3, 5), 3 * 12U + 5 * 32U);
}

TEST(Bands, TheBudgetCountsWhatIsResidentAlready) {
    BandCosts costs;
    costs.band_bytes = 1ULL << 30;
    costs.use.fragment = 28;
    costs.largest_array_bytes = 8;
    costs.use.pixel = 32;
    costs.storage_block_bytes = 128ULL << 20;
    const std::uint64_t megabyte = 1ULL << 20;
    const auto roomy = bandLimits(0, 500 * megabyte, costs);
    EXPECT_EQ(roomy.fragments, (128ULL << 20) / 8) << "the driver's limit of one block";
    const auto tight = bandLimits(600 * megabyte, 400 * megabyte, costs);
    EXPECT_LE(tight.fragments * 28 + tight.pixels * 32, 200 * megabyte);
    EXPECT_GT(tight.fragments, 0U);
    try {
        bandLimits(300 * megabyte, 400 * megabyte, costs);
        FAIL();
    } catch (const Error& error) {
        EXPECT_EQ(error.kind(), ErrorKind::kMemory);
        EXPECT_EQ(error.hint(), "give at least 504M");
    }
}

TEST(Bands, ABudgetWithRoomForASecondBandIsRoomy) {
    BandCosts costs;
    costs.band_bytes = 384ULL << 20;
    costs.use.fixed = 100ULL << 20;
    const std::uint64_t megabyte = 1ULL << 20;
    EXPECT_TRUE(isRoomy(0, 1000 * megabyte, costs)) << "no budget";
    EXPECT_TRUE(isRoomy(64 * 1024 * megabyte, 1000 * megabyte, costs));
    EXPECT_FALSE(isRoomy(1024 * megabyte, 300 * megabyte, costs));
}

TEST(Bands, AnErrorNamesWhoSetTheBudget) {
    BandCosts costs;
    costs.band_bytes = 1ULL << 20;
    costs.use.fragment = costs.largest_array_bytes = costs.use.pixel = 8;
    const auto refused = [&](const MemoryBudget& budget) {
        try {
            bandLimits(budget, 300ULL << 20, costs);
        } catch (const Error& error) {
            return error.where() + "|" + error.hint();
        }
        return std::string("not refused");
    };
    EXPECT_EQ(refused(200ULL << 20), "`memory` 200M|give at least 404M");
    EXPECT_EQ(refused({200ULL << 20, "the cgroup /a (memory.max) allows 256M"}),
              "the cgroup /a (memory.max) allows 256M|raise that limit, or give `memory` 404M to "
              "use that much anyway");
}

TEST(Bands, ResidentMemoryIsRead) {
    EXPECT_GT(residentBytes(), 1U << 20);
}

TEST(Bands, WhatWasResidentBeforeDoesNotCount) {
    MemoryBudget budget = 300ULL << 20;
    EXPECT_GT(usedBytes(budget), 1U << 20) << "all counts";
    budget.base = ~std::uint64_t{0};
    EXPECT_EQ(usedBytes(budget), 0U) << "less than before is nothing";
}

}  // namespace
}  // namespace peeler
