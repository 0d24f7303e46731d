// SPDX-License-Identifier: Apache-2.0
#include "core/image/layers.h"

#include <gtest/gtest.h>

#include <peeler/layered_image.h>
#include "formats/exr/synthetic_image.h"

namespace peeler {
namespace {

LayeredImage layeredPicture() {
    return test::makePicture({.seed = 5, .width = 40, .height = 33, .extra = true}).image;
}

/// Expects every fragment of `part`, layer by layer, to be a fragment of `whole` with the same
/// values.
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

TEST(IdSet, ListsThoseThatCountOrThoseThatDoNot) {
    EXPECT_TRUE(IdSet{}.all());
    EXPECT_TRUE(IdSet{}.holds(7));
    const IdSet some{{2, 5, 4000000000U}, false}, others{{2, 5, 4000000000U}, true};
    for (const std::uint32_t id : {0U, 1U, 2U, 3U, 5U, 6U, 4000000000U}) {
        const bool listed = id == 2 || id == 5 || id == 4000000000U;
        EXPECT_EQ(some.holds(id), listed) << id;
        EXPECT_EQ(others.holds(id), !listed) << id;
    }
    EXPECT_FALSE((IdSet{{}, false}.holds(0)));
    EXPECT_FALSE((IdSet{{}, false}.all()));
}

TEST(SelectObjects, KeepsFragmentsWhoseIdsBothCount) {
    LayeredImage image = layeredPicture();
    image.extra[1] = {{"id.object", "id.material"}, PixelType::kUint, {}};
    image.extra[1].data.resize(image.fragments() * image.extra[1].stride());
    const auto ids = image.extra[1].as<std::uint32_t>();
    for (std::size_t f = 0; f < image.fragments(); ++f) {
        ids[2 * f] = static_cast<std::uint32_t>(f * 7 % 5);
        ids[2 * f + 1] = static_cast<std::uint32_t>(f * 3 % 4);
    }
    LayeredImage kept = image;
    keepObjects(kept, {.objects = {{1, 3}, true}, .materials = {{0, 2}, false}});
    std::size_t at = 0;
    for (std::size_t p = 0; p < image.window.pixels(); ++p) {
        ASSERT_EQ(kept.offsets[p], at);
        for (std::size_t f = image.offsets[p]; f < image.offsets[p + 1]; ++f) {
            const std::uint32_t object = ids[2 * f], material = ids[2 * f + 1];
            if (object == 1 || object == 3 || material == 1 || material == 3) continue;
            ASSERT_LT(at, kept.fragments());
            EXPECT_EQ(kept.z[at], image.z[f]);
            EXPECT_EQ(findIds(kept, "id.object").id(at), object);
            EXPECT_EQ(kept.color.as<std::uint16_t>()[4 * at],
                      image.color.as<std::uint16_t>()[4 * f]);
            ++at;
        }
    }
    EXPECT_EQ(kept.offsets.back(), at);
    EXPECT_EQ(kept.fragments(), at);
    EXPECT_GT(at, 0U);
    EXPECT_LT(at, image.fragments());
    // Without ID channels every fragment has the ID 0.
    LayeredImage plain = image;
    plain.extra.pop_back();
    keepObjects(plain, {.objects = {{0}, true}, .materials = {}});
    EXPECT_EQ(plain.fragments(), 0U);
}

}  // namespace
}  // namespace peeler
