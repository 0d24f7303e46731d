// SPDX-License-Identifier: Apache-2.0
#include "core/image/holdout.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <cstdio>
#include <cstring>
#include <random>
#include <vector>

#include "core/image/composite.h"
#include "core/image/merge.h"
#include "support/flat.h"
#include "support/fragment_lists.h"

namespace peeler {
namespace {

using test::flat;
using test::TestFragment;
using Fragments = std::vector<TestFragment>;

constexpr Window kPixel{0, 0, 1, 1};

TestFragment white(float z, float alpha) {
    return {z, {alpha, alpha, alpha, alpha}};
}

LayeredImage pixel(const Fragments& fragments) {
    return test::fragmentLists(kPixel, [&](int, int) { return fragments; });
}

/// Returns the alphas of a pixel's fragments after a holdout.
std::vector<float> alphas(const Fragments& image, const LayeredImage& matte,
                          SameDepth same_depth = SameDepth::kBehind) {
    LayeredImage held = pixel(image);
    holdOut(held, matte, same_depth);
    std::vector<float> found;
    for (std::size_t i = 0; i < held.fragments(); ++i) {
        found.push_back(colorOf(held, i)[3]);
        EXPECT_EQ(colorOf(held, i)[0], found.back());
    }
    return found;
}

using Alphas = std::vector<float>;

TEST(Holdout, AFragmentShowsAsMuchAsTheMatteInFrontTransmits) {
    EXPECT_EQ(alphas({white(2, 0.5F)}, pixel({white(1, 0.25F)})), (Alphas{0.375F}));
    EXPECT_EQ(alphas({white(2, 0.5F)}, pixel({white(3, 0.25F)})), (Alphas{0.5F}));
    EXPECT_EQ(alphas({white(2, 0.5F)}, pixel({white(1, 1)})), Alphas());
    EXPECT_EQ(alphas({white(2, 0.5F)}, pixel({white(0.5F, 0.5F), white(1, 0.5F)})),
              (Alphas{0.125F}));
}

TEST(Holdout, TheWholeListShowsAsMuchAsTheMatteInFrontTransmits) {
    // The matte transmits 0.5, and the list alone covers 0.75, so 0.375 remains. If both alphas
    // were multiplied by 0.5, the sum would be 0.4375, because the first fragment would hide less
    // of the second.
    LayeredImage held = pixel({white(2, 0.5F), white(3, 0.5F)});
    holdOut(held, pixel({white(1, 0.5F)}), SameDepth::kBehind);
    EXPECT_FLOAT_EQ(flat(held).rgba[0][3], 0.375F);
    EXPECT_FLOAT_EQ(colorOf(held, 0)[3], 0.25F);
    EXPECT_FLOAT_EQ(colorOf(held, 1)[3], 1.0F / 6);
    // An opaque fragment hides all fragments behind it, even if the matte covers it in part.
    EXPECT_EQ(alphas({white(2, 1), white(3, 0.5F)}, pixel({white(1, 0.5F)})), (Alphas{0.5F}));
}

TEST(Holdout, WithoutAMatteInFrontNothingChanges) {
    const Fragments list{white(1, 0.3F), white(2, 1), white(3, 0.7F)};
    const LayeredImage before = pixel(list);
    for (const Fragments& matte : {Fragments{}, Fragments{white(4, 1)}}) {
        LayeredImage held = pixel(list);
        holdOut(held, pixel(matte), SameDepth::kInFront);
        EXPECT_EQ(held.color.data, before.color.data);
        EXPECT_EQ(held.z, before.z);
    }
}

TEST(Holdout, SameDepthIsBehindOrInFront) {
    const LayeredImage matte = pixel({white(2, 0.25F)});
    EXPECT_EQ(alphas({white(2, 0.5F)}, matte), (Alphas{0.5F}));
    EXPECT_EQ(alphas({white(2, 0.5F)}, matte, SameDepth::kInFront), (Alphas{0.375F}));
}

TEST(Holdout, AVolumeHidesMoreTheDeeperItIs) {
    LayeredImage matte = pixel({white(1, 0.75F), white(1, 0.5F)});
    FragmentArray back{{"ZBack"}, PixelType::kFloat, {}};
    const float backs[] = {3, 1};  // the second sample is a point
    back.data.resize(sizeof backs);
    std::memcpy(back.data.data(), backs, sizeof backs);
    matte.extra.push_back(back);
    const Alphas found = alphas({white(1, 1)}, matte);
    EXPECT_EQ(found, (Alphas{1}));
    EXPECT_EQ(alphas({white(2, 1)}, matte), (Alphas{0.25F}));   // 0.5 · (1 − 0.75)^(1/2)
    EXPECT_EQ(alphas({white(3, 1)}, matte), (Alphas{0.125F}));  // 0.5 · (1 − 0.75)
    EXPECT_EQ(alphas({white(9, 1)}, matte), (Alphas{0.125F}));
}

TEST(Holdout, AColouredMatteMakesOpacityColoured) {
    LayeredImage matte;
    matte.window = kPixel;
    matte.offsets = {0, 1};
    matte.z = {1};
    matte.color.channels = colorNames(true);
    matte.color.type = PixelType::kFloat;
    matte.color.data.resize(matte.color.stride());
    storeColor({0, 0, 0, 0.25F, 0, 0.25F, 0.5F}, matte.color, 0);
    LayeredImage held = pixel({{2, {0.5F, 0.5F, 0.5F, 0.5F}}});
    holdOut(held, matte, SameDepth::kBehind);
    ASSERT_TRUE(held.tinted());
    EXPECT_EQ(tintedColorOf(held, 0),
              (TintedColor{0.5F, 0.375F, 0.25F, 0.375F, 0.5F, 0.375F, 0.25F}));
}

TEST(Holdout, OutsideTheMatteNothingChanges) {
    LayeredImage held =
        test::fragmentLists({0, 0, 2, 1}, [](int, int) { return Fragments{white(2, 0.5F)}; });
    holdOut(held, pixel({white(1, 1)}), SameDepth::kBehind);
    EXPECT_EQ(held.offsets, (std::vector<std::uint32_t>{0, 0, 1}));
}

/// Returns up to 6 fragments at depths of 0 to 7, many of them equal, some of them opaque.
Fragments randomList(std::mt19937& random) {
    Fragments list(random() % 7);
    for (TestFragment& fragment : list) {
        const float alpha = random() % 5 == 0 ? 1 : static_cast<float>(random() % 1000) / 1000;
        fragment = {static_cast<float>(random() % 8), {}};
        for (std::size_t c = 0; c < 3; ++c)
            fragment.color[c] = alpha * static_cast<float>(random() % 1000) / 500;
        fragment.color[3] = alpha;
    }
    std::ranges::stable_sort(list, {}, &TestFragment::z);
    return list;
}

/// Expects that the composites of `a` and `b` add up to the composite of `whole`, also if all three
/// are cut off at any depth.
void expectSum(const LayeredImage& a, const LayeredImage& b, const LayeredImage& whole) {
    for (float depth = 0; depth < 8; ++depth) {
        const auto above = [&](const LayeredImage& image) {
            LayeredImage cut = image;
            std::vector<char> kept;
            for (const float z : image.z)
                kept.push_back(z <= depth);
            keepMarked(cut, kept);
            return flat(cut);
        };
        const CompositeImage of_a = above(a), of_b = above(b), all = above(whole);
        for (std::size_t p = 0; p < all.rgba.size(); ++p)
            for (std::size_t c = 0; c < 4; ++c)
                ASSERT_NEAR(of_a.rgba[p][c] + of_b.rgba[p][c], all.rgba[p][c], 2e-6)
                    << "pixel " << p << ", depth " << depth << ", channel " << c;
    }
}

TEST(Holdout, HeldOutByEachOtherElementsAddUpToTheWhole) {
    std::mt19937 random(7);
    const Window window{3, 5, 43, 35};
    const auto list = [&](int, int) { return randomList(random); };
    const LayeredImage elements[] = {test::fragmentLists(window, list),
                                     test::fragmentLists(window, list)};
    LayeredImage whole, a = elements[0], b = elements[1];
    mergeByDepth(elements, window, elements[0], whole);
    holdOut(a, elements[1], SameDepth::kBehind);
    holdOut(b, elements[0], SameDepth::kInFront);
    expectSum(a, b, whole);
}

TEST(Holdout, SelectedAndOtherObjectsAddUpToTheWhole) {
    std::mt19937 random(8);
    LayeredImage whole =
        test::fragmentLists({0, 0, 40, 30}, [&](int, int) { return randomList(random); });
    FragmentArray ids{{"id.object"}, PixelType::kUint, {}};
    ids.data.resize(whole.fragments() * sizeof(std::uint32_t));
    for (std::uint32_t& id : ids.as<std::uint32_t>())
        id = random() % 4;
    whole.extra.push_back(ids);
    LayeredImage a = whole, b = whole;
    holdOutSelected(a, {.objects = {{1, 2}, false}});
    holdOutSelected(b, {.objects = {{1, 2}, true}});
    for (const std::uint32_t id : a.extra[0].as<std::uint32_t>())
        EXPECT_TRUE(id == 1 || id == 2);
    expectSum(a, b, whole);
}

}  // namespace
}  // namespace peeler
