// SPDX-License-Identifier: Apache-2.0
// Tests per-channel opacity in CPU composites.
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <random>

#include "core/fragments/supersampling.h"
#include "core/image/box_filter.h"
#include "core/image/composite.h"
#include "core/image/difference.h"
#include "core/image/fxaa.h"
#include "core/image/layers.h"
#include "core/image/merge.h"
#include "core/image/statistics.h"
#include "support/fragment_lists.h"

namespace peeler {
namespace {

using Rgba = std::array<float, 4>;
using Rgb = std::array<float, 3>;

/// Returns a fragment that emits `light` and transmits `through` of the light behind it.
TintedColor glass(const Rgb& light, const Rgb& through) {
    const Rgb opacity = {1 - through[0], 1 - through[1], 1 - through[2]};
    return {light[0],   light[1],   light[2],  meanOpacity(opacity[0], opacity[1], opacity[2]),
            opacity[0], opacity[1], opacity[2]};
}
TintedColor opaque(const Rgb& light) {
    return glass(light, {0, 0, 0});
}

/// Returns a row of pixels with these fragment lists; Z counts up from 1.
LayeredImage row(const std::vector<std::vector<TintedColor>>& pixels, bool tinted = true) {
    LayeredImage image;
    image.window = {0, 0, static_cast<int>(pixels.size()), 1};
    image.color = {colorNames(tinted), PixelType::kFloat, {}};
    image.offsets = {0};
    for (const std::vector<TintedColor>& list : pixels) {
        for (std::size_t k = 0; k < list.size(); ++k)
            image.z.push_back(static_cast<float>(k + 1));
        image.offsets.push_back(static_cast<std::uint32_t>(image.z.size()));
    }
    image.color.data.resize(image.z.size() * image.color.stride());
    std::size_t fragment = 0;
    for (const std::vector<TintedColor>& list : pixels)
        for (const TintedColor& color : list)
            storeColor(color, image.color, fragment++);
    return image;
}

std::vector<std::vector<TintedColor>> randomLists(unsigned seed, bool grey) {
    std::mt19937 random(seed);
    const auto number = [&] { return static_cast<float>(random() % 1025) / 1024; };
    std::vector<std::vector<TintedColor>> lists(300);
    for (std::vector<TintedColor>& list : lists) {
        list.resize(random() % 6);
        for (TintedColor& color : list) {
            const float through = number();
            color = glass({number(), number(), number()}, grey ? Rgb{through, through, through}
                                                               : Rgb{number(), number(), number()});
        }
    }
    return lists;
}

TEST(TintedComposite, ThroughPanesComesTheProductOfWhatTheyLetPass) {
    // Powers of two make all results exact.
    const LayeredImage image =
        row({{glass({0, 0, 0}, {0.5F, 0.25F, 1}), glass({0.125F, 0, 0}, {1, 0.5F, 0.25F}),
              opaque({1, 0.5F, 0.25F})}});
    CompositeImage out;
    compositeOver(image, {}, out);
    const TintedColor expected = {
        0.5F * 0.125F + 0.5F, 0.25F * 0.5F * 0.5F, 0.25F * 0.25F, 1, 1, 1, 1};
    EXPECT_EQ(out.colorAt(0), expected);
}

TEST(TintedComposite, LeavesWhatPassesOfTheBackground) {
    const LayeredImage image = row({{glass({0.5F, 0, 0}, {0.25F, 0.5F, 1})}, {}});
    CompositeImage out;
    compositeOver(image, {}, out);
    EXPECT_EQ(out.opacity[0], (Rgb{0.75F, 0.5F, 0}));
    EXPECT_FLOAT_EQ(out.rgba[0][3], 1.25F / 3);
    EXPECT_EQ(out.colorAt(1), TintedColor{});
    compositeOver(image, {1, 1, 0.5F, 1}, out);
    EXPECT_EQ(out.colorAt(0), (TintedColor{0.75F, 0.5F, 0.5F, 1, 1, 1, 1}));
    EXPECT_EQ(out.colorAt(1), (TintedColor{1, 1, 0.5F, 1, 1, 1, 1}));
}

TEST(TintedComposite, WithEqualOpacitiesHasTheBitsOfAPlainOne) {
    const auto lists = randomLists(11, true);
    const LayeredImage plain = row(lists, false), grey = row(lists, true);
    using Formula = void (*)(const LayeredImage&, const Rgba&, CompositeImage&);
    for (const Formula formula : {Formula{compositeOver}, Formula{compositeWeightedAverage},
                                  Formula{compositeWeightedSum}}) {
        CompositeImage a, b;
        formula(plain, {0.25F, 0.5F, 0.75F, 0.75F}, a);
        formula(grey, {0.25F, 0.5F, 0.75F, 0.75F}, b);
        EXPECT_FALSE(a.tinted());
        ASSERT_TRUE(b.tinted());
        for (std::size_t p = 0; p < a.rgba.size(); ++p) {
            for (std::size_t c = 0; c < 3; ++c) {
                EXPECT_EQ(a.rgba[p][c], b.rgba[p][c]) << p;
                EXPECT_EQ(a.rgba[p][3], b.opacity[p][c]) << p;
            }
        }
    }
    CompositeImage a, b;
    compositeNearest(plain, 2, Tail::kBlend, a);
    compositeNearest(grey, 2, Tail::kBlend, b);
    for (std::size_t p = 0; p < a.rgba.size(); ++p)
        EXPECT_EQ(tinted(a.rgba[p]), b.colorAt(p)) << p;
}

TEST(TintedComposite, OfEachChannelIsThatOfAPictureOfTheChannel) {
    const auto lists = randomLists(12, false);
    CompositeImage all;
    for (const Tail tail : {Tail::kDrop, Tail::kBlend}) {
        compositeNearest(row(lists), 2, tail, all);
        for (std::size_t c = 0; c < 3; ++c) {
            auto alone = lists;
            for (auto& list : alone)
                for (TintedColor& color : list)
                    color = tinted({color[0], color[1], color[2], color[4 + c]});
            CompositeImage one;
            compositeNearest(row(alone, false), 2, tail, one);
            for (std::size_t p = 0; p < one.rgba.size(); ++p) {
                EXPECT_EQ(all.rgba[p][c], one.rgba[p][c]) << p;
                EXPECT_EQ(all.opacity[p][c], one.rgba[p][3]) << p;
            }
        }
    }
}

TEST(TintedComposite, AlphaIsTheMeanAndExactlyTheOpacityIfAllAreEqual) {
    EXPECT_EQ(meanOpacity(0.25F, 0.5F, 0.75F), 0.5F);
    std::mt19937 random(13);
    for (int i = 0; i < 1000; ++i) {
        const auto a = std::generate_canonical<float, 24>(random);
        EXPECT_EQ(meanOpacity(a, a, a), a);
    }
}

TEST(TintedComposite, AsASingleLayerCompositesToItself) {
    CompositeImage composite, again;
    compositeOver(row(randomLists(14, false)), {}, composite);
    LayeredImage layer;
    toSingleLayer(composite, layer);
    EXPECT_EQ(layer.color.channels, colorNames(true));
    compositeOver(layer, {}, again);
    EXPECT_EQ(again.rgba, composite.rgba);
    EXPECT_EQ(again.opacity, composite.opacity);
    EXPECT_EQ(again.z, composite.z);
}

TEST(TintedComposite, StaysWhereDeepSamplesAreMerged) {
    const LayeredImage image = row(randomLists(15, false));
    LayeredImage merged;
    mergeDeepSamples(image, 0, 1, {.mode = DeepMerge::kByZ, .z_tolerance = 2}, merged);
    EXPECT_LT(merged.fragments(), image.fragments());
    CompositeImage before, after;
    compositeOver(image, {}, before);
    compositeOver(merged, {}, after);
    for (std::size_t p = 0; p < before.rgba.size(); ++p)
        for (std::size_t c = 0; c < kTintedComponents; ++c)
            EXPECT_NEAR(before.colorAt(p)[c], after.colorAt(p)[c], 1e-6F) << p;
}

TEST(TintedComposite, OfMergedSamplesIsTheMeanOfTheSamples) {
    std::vector<LayeredImage> samples;
    CompositeImage mean, sample;
    for (unsigned s = 0; s < 4; ++s) {
        LayeredImage& image = samples.emplace_back(row(randomLists(20 + s, false)));
        compositeOver(image, {}, sample);
        if (s == 0) beginMean(sample.window, mean, true);
        addToMean(sample, 4, mean);
        FragmentArray& keys =
            image.extra.emplace_back(FragmentArray{{kKeyChannel}, PixelType::kUint, {}});
        keys.data.resize(image.fragments() * sizeof(std::uint32_t));
        for (std::size_t p = 0; p < image.window.pixels(); ++p)
            for (std::uint32_t k = 0; k < image.count(p); ++k)
                keys.as<std::uint32_t>()[image.offsets[p] + k] = k % 3;
    }
    LayeredImage merged;
    mergeSamples(
        samples, [](std::uint32_t key) { return key; }, PixelType::kFloat, merged);
    ASSERT_TRUE(merged.tinted());
    compositeOver(merged, {}, sample);
    for (std::size_t p = 0; p < mean.rgba.size(); ++p)
        for (std::size_t c = 0; c < kTintedComponents; ++c)
            EXPECT_NEAR(sample.colorAt(p)[c], mean.colorAt(p)[c], 1e-5F) << p << ' ' << c;
}

TEST(TintedComposite, IsComparedAndCheckedWithItsOpacities) {
    const LayeredImage a = row({{glass({0, 0, 0}, {0.5F, 0.5F, 0.5F})}});
    // The channels have different opacities with the same mean.
    const LayeredImage b = row({{glass({0, 0, 0}, {0.25F, 0.5F, 0.75F})}});
    LayeredDifference difference;
    addDifference(a, b, difference);
    EXPECT_EQ(difference.all.color.values, kTintedComponents);
    EXPECT_EQ(difference.all.color.largest, 0.25);
    EXPECT_EQ(difference.composite.largest, 0.25);
    CompositeImage stored;
    compositeOver(a, {}, stored);
    BrokenPixels good, broken;
    findWrongComposite(a, stored, PixelType::kFloat, good);
    findWrongComposite(b, stored, PixelType::kFloat, broken);
    EXPECT_EQ(good.pixels, 0U);
    EXPECT_EQ(broken.pixels, 1U);
    // A picture without AR, AG and AB equals a picture in which all three are A.
    LayeredDifference plain;
    addDifference(a, row({{glass({0, 0, 0}, {0.5F, 0.5F, 0.5F})}}, false), plain);
    EXPECT_EQ(plain.all.color.largest, 0);
}

TEST(TintedComposite, IsFilteredInAllItsChannels) {
    BoxFilter filter(2, 1, 1, 1);
    const std::array<TintedColor, 2> pixels = {glass({1, 0, 0}, {0, 0.5F, 1}),
                                               glass({0, 0, 0}, {1, 0.5F, 0})};
    filter.addRow(pixels);
    EXPECT_EQ(filter.pixels()[0], (TintedColor{0.5F, 0, 0, 0.5F, 0.5F, 0.5F, 0.5F}));

    // A jagged edge that is opaque in only one channel is smoothed only in that channel.
    CompositeImage picture;
    picture.window = {0, 0, 16, 8};
    picture.resizeColors(true);
    picture.z.assign(picture.window.pixels(), 1);
    for (int y = 0; y < 8; ++y)
        for (int x = 0; x < 16; ++x)
            if (y > 3 + x / 8)
                picture.setColor(static_cast<std::size_t>(16 * y + x), glass({0, 0, 0}, {1, 0, 1}));
    CompositeImage smooth;
    applyFxaa(picture, {1, 1, 1, 1}, 0, 8, smooth);
    ASSERT_EQ(smooth.opacity.size(), picture.opacity.size());
    int blended = 0;
    for (const Rgb& opacity : smooth.opacity) {
        EXPECT_EQ(opacity[0], 0);
        blended += opacity[1] > 0 && opacity[1] < 1 ? 1 : 0;
    }
    EXPECT_GT(blended, 4);
}

TEST(TintedComposite, LayersKeepTheirOpacities) {
    const auto lists = randomLists(17, false);
    LayeredImage image = row(lists), second;
    singleLayer(image, 1, second);
    keepLayers(image, {.nearest = 0, .listed = {false, true}});
    EXPECT_EQ(image.color.data, second.color.data);
    std::size_t fragment = 0;
    for (const auto& list : lists) {
        if (list.size() <= 1) continue;
        EXPECT_EQ(tintedColorOf(second, fragment++), list[1]);
    }
}

}  // namespace
}  // namespace peeler
