// SPDX-License-Identifier: Apache-2.0
// Tests deep EXR files of other programs: unsorted samples, tiles, related parts, and unreadable
// files.
#include <gtest/gtest.h>

#include <array>
#include <cfloat>
#include <cmath>
#include <filesystem>
#include <vector>

#include <peeler/error.h>
#include "formats/exr/damaged_exr.h"
#include "formats/exr/deep_file.h"
#include "formats/exr/exr_layout.h"
#include "formats/exr/exr_readers.h"
#include "formats/exr/read_all.h"
#include "formats/layered/opened_picture.h"
#include "support/test_support.h"

namespace peeler {
namespace {

namespace fs = std::filesystem;
using test::DeepPart;
using test::readAll;

/// Returns a part with samples in two pixels: (5, 4) has three unsorted samples, (6, 4) has one at
/// infinity.
DeepPart foreignPart(Imf::PixelType depth_type) {
    DeepPart part;
    part.window = {{3, 2}, {12, 9}};
    part.counts.assign(part.pixels(), 0);
    part.types = {{"R", Imf::HALF}, {"A", Imf::FLOAT}, {"Z", depth_type}};
    const std::size_t p = 2 * part.width() + 2;
    part.counts[p] = 3;
    part.counts[p + 1] = 1;
    for (const auto& [name, type] : part.types)
        part.values[name].resize(part.pixels());
    part.values["Z"][p] = {2, 1, 2};
    part.values["R"][p] = {0.25, 0.5, 0.125};
    part.values["A"][p] = {0.3, 0.2, 0.1};
    part.values["Z"][p + 1] = {HUGE_VAL};
    part.values["R"][p + 1] = {1};
    part.values["A"][p + 1] = {1};
    return part;
}

void expectForeign(const LayeredImage& image) {
    const std::size_t p = image.pixelIndex(5, 4);
    ASSERT_EQ(image.fragments(), 4U);
    ASSERT_EQ(image.count(p), 3U);
    ASSERT_EQ(image.count(p + 1), 1U);
    EXPECT_EQ(image.z, (std::vector<float>{1, 2, 2, FLT_MAX}));
    ASSERT_EQ(image.color.type, PixelType::kFloat);
    using Color = std::array<float, 4>;
    EXPECT_EQ(colorOf(image, 0), (Color{0.5F, 0, 0, 0.2F}));
    // Sorting is stable, so this sample stays the first at Z = 2.
    EXPECT_EQ(colorOf(image, 1), (Color{0.25F, 0, 0, 0.3F}));
    EXPECT_EQ(colorOf(image, 2), (Color{0.125F, 0, 0, 0.1F}));
    EXPECT_EQ(colorOf(image, 3), (Color{1, 0, 0, 1}));
}

class ForeignDeep : public testing::Test {
  protected:
    test::ScratchDir scratch;
};

TEST_F(ForeignDeep, ScanLinesAndTilesAreSorted) {
    for (const Imf::PixelType type : {Imf::HALF, Imf::FLOAT}) {
        for (const int tile : {0, 3, 4, 64}) {
            for (const auto compression :
                 {Imf::NO_COMPRESSION, Imf::RLE_COMPRESSION, Imf::ZIPS_COMPRESSION}) {
                SCOPED_TRACE(testing::Message() << type << " " << tile << " " << compression);
                const fs::path path = scratch / "foreign.exr";
                test::writeDeepFile(path, {foreignPart(type)},
                                    {.compression = compression, .tile = tile});
                ASSERT_NO_THROW(expectForeign(readAll(path)));
                const auto reader = openLayered(path);
                EXPECT_EQ(reader->info().plan.fragments_counted, 4U);
                EXPECT_EQ(reader->info().plan.layers.size(), 3U);
                EXPECT_FALSE(reader->info().plan.view.known);
                LayeredImage row;
                reader->read({5, 4, 6, 5}, row);
                EXPECT_EQ(row.fragments(), 3U);
            }
        }
    }
}

TEST_F(ForeignDeep, WithoutAlphaItIsOpaqueAndGreyIsThreeColours) {
    DeepPart part = foreignPart(Imf::FLOAT);
    part.types.erase("A");
    part.types["Y"] = part.types["R"];
    part.values["Y"] = part.values["R"];
    part.types.erase("R");
    part.types["ZBack"] = Imf::FLOAT;
    part.values["ZBack"] = part.values["Z"];
    test::writeDeepFile(scratch / "grey.exr", {part});
    const LayeredImage image = readAll(scratch / "grey.exr");
    ASSERT_EQ(image.color.type, PixelType::kHalf);
    EXPECT_EQ(colorOf(image, 0), (std::array<float, 4>{0.5F, 0.5F, 0.5F, 1}));
    ASSERT_EQ(image.extra.size(), 1U);
    EXPECT_EQ(image.extra[0].channels.front(), "ZBack");
    EXPECT_EQ(image.extra[0].as<float>()[0], 1);
}

TEST_F(ForeignDeep, PartsOfTheSameSamplesAreJoinedAndOthersAreNot) {
    DeepPart first = foreignPart(Imf::FLOAT), second = first, third = first;
    second.name = "ids";
    second.types = {{"Z", Imf::FLOAT}, {"object", Imf::UINT}};
    second.values["object"].resize(second.pixels());
    const std::size_t p = 2 * first.width() + 2;
    second.values["object"][p] = {7, 8, 9};
    second.values["object"][p + 1] = {4294967295.0};
    third.name = "other";
    third.types = {{"mask", Imf::HALF}};
    third.values["mask"] = third.values["R"];
    third.counts[p + 1] = 0;
    test::writeDeepFile(scratch / "parts.exr", {first, second, third});
    const LayeredImage image = readAll(scratch / "parts.exr");
    expectForeign(image);
    ASSERT_EQ(image.extra.size(), 1U);  // the mask is ignored, since its sample counts differ
    EXPECT_EQ(image.extra[0].channels.front(), "object");
    const auto ids = image.extra[0].as<std::uint32_t>();
    EXPECT_EQ(std::vector<std::uint32_t>(ids.begin(), ids.end()),
              (std::vector<std::uint32_t>{8, 7, 9, 4294967295U}));
}

TEST_F(ForeignDeep, WithoutZThereIsNoOrder) {
    DeepPart part = foreignPart(Imf::FLOAT);
    part.types.erase("Z");
    test::writeDeepFile(scratch / "flat.exr", {part});
    try {
        openLayered(scratch / "flat.exr");
        FAIL() << "nothing was thrown";
    } catch (const Error& e) {
        EXPECT_EQ(e.kind(), ErrorKind::kInput);
        EXPECT_NE(e.hint(), "");
    }
}

TEST_F(ForeignDeep, DamagedTilesAreErrorsNotCrashes) {
    std::uint32_t seed = 6;
    for (const ExrCompression& compression : exrCompressions()) {
        if (!compression.deep) continue;
        test::writeDeepFile(
            scratch / "tiles.exr", {foreignPart(Imf::HALF)},
            {.compression = static_cast<Imf::Compression>(compression.value), .tile = 4});
        EXPECT_GT(test::refusalsOfDamaged(scratch / "tiles.exr", seed, 150), 37);
        seed += 2;
    }
}

}  // namespace
}  // namespace peeler
