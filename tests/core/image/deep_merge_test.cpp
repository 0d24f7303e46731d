// SPDX-License-Identifier: Apache-2.0
// Tests the merging of deep samples: which samples are merged, and that each pixel looks the same.
#include "core/image/merge.h"

#include <gtest/gtest.h>

#include <array>
#include <cmath>
#include <cstring>
#include <locale>
#include <string>

#include <peeler/composite.h>
#include <peeler/error.h>
#include "formats/exr/synthetic_image.h"

namespace peeler {
namespace {

struct Sample {
    float z, alpha;
    std::uint32_t object, material;
};

/// Returns a picture of two pixels, an empty one and one with these samples. Red is alpha / 2;
/// green and blue are 0.
LayeredImage pixelOf(const std::vector<Sample>& samples) {
    LayeredImage image;
    image.window = {0, 0, 2, 1};
    image.offsets = {0, 0, static_cast<std::uint32_t>(samples.size())};
    image.color = {{"R", "G", "B", "A"}, PixelType::kFloat, {}};
    image.extra = {{{"id.material", "id.object"}, PixelType::kUint, {}}};
    for (const Sample& sample : samples) {
        image.z.push_back(sample.z);
        for (const float value : {sample.alpha / 2, 0.0F, 0.0F, sample.alpha})
            test::appendValue(image.color.data, value);
        test::appendValue(image.extra[0].data, sample.material);
        test::appendValue(image.extra[0].data, sample.object);
    }
    return image;
}

LayeredImage mergedDeep(const LayeredImage& image, const DeepMergeSettings& settings) {
    LayeredImage out;
    mergeDeepSamples(image, image.window.y0, image.window.y1, settings, out);
    return out;
}

using Depths = std::vector<float>;

TEST(DeepMerge, ExactTakesWhatIsAtTheVerySameDepth) {
    const LayeredImage image = pixelOf(
        {{1, 0.5F, 1, 1}, {1, 0.5F, 2, 1}, {std::nextafter(1.0F, 2.0F), 0.5F, 1, 1}, {3, 1, 1, 1}});
    const LayeredImage out = mergedDeep(image, {DeepMerge::kExact, 0, 1});
    EXPECT_EQ(out.z, (Depths{1, std::nextafter(1.0F, 2.0F), 3}));
    EXPECT_EQ(out.offsets, (std::vector<std::uint32_t>{0, 0, 3}));
    // The result is one half-opaque sample over the other: 0.5 + 0.5 · 0.5.
    EXPECT_EQ(colorOf(out, 0), (std::array<float, 4>{0.375F, 0, 0, 0.75F}));
    EXPECT_EQ(colorOf(out, 1), colorOf(image, 2));
    // The other channels are those of the nearest sample.
    EXPECT_EQ(out.extra[0].as<std::uint32_t>()[1], 1U);
}

TEST(DeepMerge, ByZMeasuresFromTheNearestSoThatRunsDoNotCreep) {
    const LayeredImage image =
        pixelOf({{1, 0.5F, 1, 1}, {1.5F, 0.5F, 2, 1}, {2, 0.5F, 3, 1}, {2.5F, 0.5F, 4, 1}});
    EXPECT_EQ(mergedDeep(image, {DeepMerge::kByZ, 0.5F, 1}).z, (Depths{1, 2}));
    EXPECT_EQ(mergedDeep(image, {DeepMerge::kByZ, 0.49F, 1}).z, (Depths{1, 1.5F, 2, 2.5F}));
    EXPECT_EQ(mergedDeep(image, {DeepMerge::kByZ, 10, 1}).z, (Depths{1}));
}

TEST(DeepMerge, ByIdWantsObjectMaterialDepthAndAlphaAlikeAndNothingBetween) {
    const LayeredImage image =
        pixelOf({{1, 0.5F, 1, 1},      // merged with the next sample
                 {1.1F, 0.6F, 1, 1},   //
                 {1.2F, 0.5F, 2, 1},   // another object
                 {1.3F, 0.5F, 1, 1},   // the first object again, but behind another object
                 {1.4F, 0.5F, 1, 2},   // another material
                 {1.45F, 0.9F, 1, 2},  // too different in alpha
                 {3, 0.9F, 1, 2}});    // too far away in Z
    EXPECT_EQ(mergedDeep(image, {DeepMerge::kById, 1, 0.2F}).z,
              (Depths{1, 1.2F, 1.3F, 1.4F, 1.45F, 3}));
    EXPECT_EQ(mergedDeep(image, {DeepMerge::kById, 1, 1}).z, (Depths{1, 1.2F, 1.3F, 1.4F, 3}));
}

TEST(DeepMerge, ByIdWithoutIdsSaysHowToGetThem) {
    LayeredImage image = pixelOf({{1, 1, 1, 1}}), out;
    image.extra.clear();
    try {
        mergeDeepSamples(image, 0, 1, {DeepMerge::kById, 1, 1}, out);
        FAIL() << "nothing was thrown";
    } catch (const Error& error) {
        EXPECT_EQ(error.kind(), ErrorKind::kUsage);
        EXPECT_NE(error.hint().find("`channels` id"), std::string::npos);
    }
}

TEST(DeepMerge, TheCompositeStaysWithinRounding) {
    for (const PixelType type : {PixelType::kHalf, PixelType::kFloat}) {
        const test::SyntheticPicture picture = test::makePicture({.seed = 9, .color_type = type});
        const LayeredImage& image = picture.image;
        for (const float tolerance : {0.0F, 0.3F, 100.0F}) {
            LayeredImage out;
            const int y0 = image.window.y0 + 5, y1 = image.window.y1 - 7;
            mergeDeepSamples(image, y0, y1, {DeepMerge::kByZ, tolerance, 1}, out);
            const LayeredImage rows = test::cutRows(image, y0, y1);
            EXPECT_LT(out.fragments(), rows.fragments());
            CompositeImage before, after;
            compositeOver(rows, {}, before);
            compositeOver(out, {}, after);
            EXPECT_EQ(before.z, after.z);
            // The error of halves: colours reach 3, a half has 11 significant bits, and several
            // samples are rounded.
            const float bound = type == PixelType::kHalf ? 8e-3F : 4e-6F;
            for (std::size_t p = 0; p < before.rgba.size(); ++p) {
                for (std::size_t c = 0; c < 4; ++c)
                    ASSERT_NEAR(before.rgba[p][c], after.rgba[p][c], bound) << p;
            }
        }
    }
}

/// The host program may have set a different global locale.
TEST(DeepMerge, ItsWordsAreTheSameInEveryLocale) {
    struct Comma : std::numpunct<char> {
        char do_decimal_point() const override { return ','; }
    };
    DeepMergeSettings settings;
    settings.mode = DeepMerge::kByZ;
    settings.z_tolerance = 0.5F;
    const std::locale before = std::locale::global(std::locale(std::locale::classic(), new Comma));
    const std::string text = deepMergeText(settings);
    std::locale::global(before);
    EXPECT_EQ(text, "by-z z 0.5");
}

}  // namespace
}  // namespace peeler
