// SPDX-License-Identifier: Apache-2.0
#include "core/image/layers.h"

#include <gtest/gtest.h>

#include "core/image/layered_image.h"
#include "formats/synthetic_image.h"

namespace peeler {
namespace {

LayeredImage layeredPicture() {
    return test::makePicture({.seed = 5, .width = 40, .height = 33, .extra = true}).image;
}

/// Every fragment of `part`, layer by layer, is one of `whole` with all that belongs to it.
void expectFragments(const LayeredImage& whole, const LayeredImage& part,
                     const LayerSelection& selection) {
    ASSERT_EQ(part.offsets.size(), whole.offsets.size());
    for (std::size_t p = 0; p < whole.window.pixels(); ++p) {
        std::size_t at = part.offsets[p];
        for (std::uint32_t k = 0; k < whole.count(p); ++k) {
            if (!selection.holds(k)) continue;
            const std::size_t f = whole.offsets[p] + k;
            ASSERT_LT(at, part.fragments());
            EXPECT_EQ(part.z[at], whole.z[f]);
            for (std::size_t c = 0; c < 4; ++c) {
                EXPECT_EQ(part.color.as<std::uint16_t>()[4 * at + c],
                          whole.color.as<std::uint16_t>()[4 * f + c]);
            }
            EXPECT_EQ(part.extra[1].as<std::uint32_t>()[at], whole.extra[1].as<std::uint32_t>()[f]);
            EXPECT_EQ(findChannel(part, "N.Y").value(at), findChannel(whole, "N.Y").value(f));
            ++at;
        }
        EXPECT_EQ(at, part.offsets[p + 1]);
    }
    EXPECT_EQ(part.color.data.size(), part.fragments() * part.color.stride());
    EXPECT_EQ(part.extra[0].data.size(), part.fragments() * part.extra[0].stride());
}

TEST(SelectLayers, KeepsWhatIsChosen) {
    const LayeredImage whole = layeredPicture();
    const LayerSelection selections[] = {
        {},
        {.nearest = 1},
        {.nearest = 2},
        {.nearest = 99},
        {.nearest = 0, .listed = {false, true, false, true}},
        {.nearest = 2, .listed = {false, true, false, true}},
        {.nearest = 0, .listed = {false, false, false, false, false, false, false, false, true}}};
    for (const LayerSelection& selection : selections) {
        LayeredImage kept = whole;
        keepLayers(kept, selection);
        expectFragments(whole, kept, selection);
    }
}

TEST(SelectLayers, ASingleLayerIsWhatKeepingItLeaves) {
    const LayeredImage whole = layeredPicture();
    LayeredImage single;
    for (std::uint32_t k = 0; k < 8; ++k) {
        LayerSelection selection;
        selection.listed.resize(k + 1);
        selection.listed[k] = true;
        singleLayer(whole, k, single);
        expectFragments(whole, single, selection);
    }
}

TEST(SelectLayers, IndicesFollowTheirFragments) {
    LayeredImage image = layeredPicture();
    addLayerIndices(image);
    keepLayers(image, {.nearest = 0, .listed = {false, true, false, true}});
    const FragmentChannel layer = findChannel(image, "layer");
    ASSERT_TRUE(layer);
    for (std::size_t p = 0; p < image.window.pixels(); ++p) {
        for (std::uint32_t i = 0; i < image.count(p); ++i)
            EXPECT_EQ(layer.value(image.offsets[p] + i), 2.0F * static_cast<float>(i) + 1);
    }
    EXPECT_FALSE(findChannel(image, "N.W"));
}

}  // namespace
}  // namespace peeler
