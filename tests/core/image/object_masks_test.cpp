// SPDX-License-Identifier: Apache-2.0
// Tests object masks made from known fragment lists.
#include "core/image/object_masks.h"

#include <gtest/gtest.h>

#include <array>
#include <span>

#include <peeler/error.h>
#include "support/fragment_lists.h"

namespace peeler::test {
namespace {

struct Seen {
    std::uint32_t node = 0, instance = 1, material = 1;  ///< IDs start at 1
    float alpha = 1;
};
using Pixels = std::vector<std::vector<Seen>>;

/// Returns a picture with these fragments: pixels in row order, fragments from front to back.
LayeredImage imageOf(const Window& window, const Pixels& pixels) {
    std::size_t p = 0;
    LayeredImage image = fragmentLists(window, [&](int, int) {
        std::vector<TestFragment> fragments;
        for (const Seen& seen : pixels[p])
            fragments.push_back({1, {0, 0, 0, seen.alpha}});
        ++p;
        return fragments;
    });
    FragmentArray ids;
    ids.channels = {"id.object", "id.material", "id.primitive", "id.instance"};
    ids.type = PixelType::kUint;
    for (const auto& pixel : pixels) {
        for (const Seen& seen : pixel) {
            const std::array<std::uint32_t, 4> id = {seen.node, seen.material, 1, seen.instance};
            const auto bytes = std::as_bytes(std::span(id));
            ids.data.insert(ids.data.end(), bytes.begin(), bytes.end());
        }
    }
    image.extra.push_back(std::move(ids));
    return image;
}

Plan planOf(const LayeredImage& image) {
    Plan plan;
    plan.view.crop = image.window;
    plan.fragments_stored = plan.fragments_counted = image.fragments();
    return plan;
}

std::vector<PixelRuns::Run> runsOf(const PixelRuns& pixels) {
    return {pixels.runs().begin(), pixels.runs().end()};
}
using Runs = std::vector<PixelRuns::Run>;
using Counts = std::vector<std::uint32_t>;

/// Six pixels. First row: object 1 in front of 2; 2 in front of 1 in front of 2; empty. Second row:
/// background in front of object 1; object 1 alone; background alone.
const Window kWindow{0, 0, 3, 2};
const Pixels kPixels = {{{1, 1, 1, 0.25F}, {2}},
                        {{2, 1, 1, 0.5F}, {1}, {2}},
                        {},
                        {{3}, {1}},
                        {{1, 1, 1, 0.25F}},
                        {{3}}};
const ObjectTable kTable{.numbers = {1, 2, 0}, .objects = 2};

TEST(ObjectMasks, AreWhereObjectsAreAndWhereTheyAreSeen) {
    ObjectMaskSink sink(kTable, {.picture = kWindow, .layers = true});
    LayeredImage image = imageOf(kWindow, kPixels);
    sink.begin(planOf(image));
    sink.write(std::move(image));
    sink.finish();
    const ObjectMasks &first = sink.objects()[0], &second = sink.objects()[1];
    EXPECT_EQ(runsOf(first.amodal), (Runs{{0, 2}, {3, 5}})) << "none over the end of a row";
    EXPECT_EQ(runsOf(second.amodal), (Runs{{0, 2}})) << "twice behind a pixel is once";
    EXPECT_EQ(runsOf(first.visible), (Runs{{0, 1}, {4, 5}}));
    EXPECT_EQ(runsOf(second.visible), (Runs{{1, 2}}));
    EXPECT_EQ(first.amodal.count(), 4U);
    EXPECT_EQ(first.canvas_pixels, 4U);
    EXPECT_EQ(first.amodal.box(), (Window{0, 0, 2, 2}));
    EXPECT_EQ(first.canvas_box, (Window{0, 0, 2, 2}));
    EXPECT_EQ(first.visibleFraction(), 0.5);
    EXPECT_EQ(second.visibleFraction(), 0.5);
    EXPECT_EQ(sink.layers().layers(), 3U);
    EXPECT_EQ(sink.layers().layer(0), (std::vector<std::uint16_t>{1, 2, 0, 0, 1, 0}));
    EXPECT_EQ(sink.layers().layer(1), (std::vector<std::uint16_t>{2, 1, 0, 1, 0, 0}));
    EXPECT_EQ(sink.layers().layer(2), (std::vector<std::uint16_t>{0, 2, 0, 0, 0, 0}));
}

TEST(ObjectMasks, AreSeenThroughWhatIsTransparent) {
    const struct {
        float see_through;
        Runs first, second;
    } cases[] = {
        {0.25F, {{0, 1}, {4, 5}}, {{1, 2}}},
        // An opacity of 0.25 is now see-through, except in front of an empty background.
        {0.4F, {{4, 5}}, {{0, 2}}},
        {0.75F, {{1, 2}, {4, 5}}, {{0, 1}}}  // an opacity of 0.5 is now see-through, too
    };
    for (const auto& [see_through, first, second] : cases) {
        ObjectMaskSink sink(kTable, {.picture = kWindow, .see_through = see_through});
        LayeredImage image = imageOf(kWindow, kPixels);
        sink.begin(planOf(image));
        sink.write(std::move(image));
        EXPECT_EQ(runsOf(sink.objects()[0].visible), first) << see_through;
        EXPECT_EQ(runsOf(sink.objects()[1].visible), second) << see_through;
        EXPECT_EQ(sink.objects()[0].amodal.count(), 4U);
    }
}

TEST(ObjectMasks, DoNotDependOnBands) {
    ObjectMaskSink sink(kTable, {.picture = kWindow, .layers = true});
    sink.begin(planOf(imageOf(kWindow, kPixels)));
    sink.write(imageOf({0, 0, 3, 1}, {kPixels.begin(), kPixels.begin() + 3}));
    sink.write(imageOf({0, 1, 3, 2}, {kPixels.begin() + 3, kPixels.end()}));
    EXPECT_EQ(runsOf(sink.objects()[0].amodal), (Runs{{0, 2}, {3, 5}}));
    EXPECT_EQ(runsOf(sink.objects()[0].visible), (Runs{{0, 1}, {4, 5}}));
    EXPECT_EQ(sink.layers().layer(1), (std::vector<std::uint16_t>{2, 1, 0, 1, 0, 0}));
}

TEST(ObjectMasks, OfACanvasAreOfItsMiddle) {
    // The picture is the canvas's middle pixel. Object 1 covers this pixel and the pixel on its
    // left, object 2 the pixel on its right.
    const Window canvas{0, 0, 3, 1};
    ObjectMaskSink sink(kTable, {.picture = {1, 0, 2, 1}, .layers = true});
    LayeredImage image = imageOf(canvas, {{{1}}, {{1}}, {{2}}});
    sink.begin(planOf(image));
    sink.write(std::move(image));
    const ObjectMasks &first = sink.objects()[0], &second = sink.objects()[1];
    EXPECT_EQ(first.canvas_pixels, 2U);
    EXPECT_EQ(first.canvas_box, (Window{-1, 0, 1, 1}));
    EXPECT_EQ(runsOf(first.amodal), (Runs{{0, 1}}));
    EXPECT_EQ(first.visibleFraction(), 0.5);
    EXPECT_EQ(second.canvas_pixels, 1U);
    EXPECT_EQ(second.canvas_box, (Window{1, 0, 2, 1}));
    EXPECT_EQ(second.amodal.count(), 0U);
    EXPECT_EQ(second.visibleFraction(), 0);
    EXPECT_EQ(sink.layers().layer(0), (std::vector<std::uint16_t>{1}));
}

TEST(ObjectMasks, GoByInstanceOrMaterial) {
    const Window window{0, 0, 2, 1};
    const Pixels pixels = {{{1, 2, 7}}, {{2, 1, 8}, {1, 1, 7}}};
    const ObjectTable instances{.instances_apart = true, .numbers = {1, 3}, .objects = 3};
    ObjectMaskSink by_instance(instances, {.picture = window});
    by_instance.begin(planOf(imageOf(window, pixels)));
    by_instance.write(imageOf(window, pixels));
    EXPECT_EQ(runsOf(by_instance.objects()[0].amodal), (Runs{{1, 2}}));
    EXPECT_EQ(runsOf(by_instance.objects()[1].amodal), (Runs{{0, 1}}));
    EXPECT_EQ(runsOf(by_instance.objects()[2].visible), (Runs{{1, 2}}));
    ObjectTable materials{
        .by_material = true, .numbers = std::vector<std::uint32_t>(8, 0), .objects = 1};
    materials.numbers[6] = 1;
    ObjectMaskSink by_material(materials, {.picture = window});
    by_material.begin(planOf(imageOf(window, pixels)));
    by_material.write(imageOf(window, pixels));
    EXPECT_EQ(runsOf(by_material.objects()[0].amodal), (Runs{{0, 2}}));
    EXPECT_EQ(runsOf(by_material.objects()[0].visible), (Runs{{0, 1}}));
}

TEST(ObjectMasks, NeedIds) {
    ObjectMaskSink sink(kTable, {.picture = kWindow});
    LayeredImage image = imageOf(kWindow, kPixels);
    sink.begin(planOf(image));
    image.extra.clear();
    EXPECT_THROW(sink.write(std::move(image)), Error);
}

TEST(ObjectMasks, TellTheMemoryOfTheirWorstCase) {
    // A checkerboard of two objects is the worst case: every fragment is a run of its own.
    const Window window{0, 0, 64, 64};
    Pixels pixels;
    for (std::uint32_t y = 0; y < 64; ++y)
        for (std::uint32_t x = 0; x < 64; ++x)
            pixels.push_back({{1 + (x + y) % 2}});
    ObjectMaskSink sink(kTable, {.picture = window});
    sink.begin(planOf(imageOf(window, pixels)));
    sink.write(imageOf(window, pixels));
    std::uint64_t runs = 0;
    for (const ObjectMasks& object : sink.objects())
        runs += object.amodal.runs().size() + object.visible.runs().size();
    EXPECT_EQ(runs, 2U * 64 * 64);
    const std::uint64_t told = sink.memory(planOf(imageOf(window, pixels))).bytes;
    EXPECT_GE(told, runs * sizeof(PixelRuns::Run));
    EXPECT_LT(told, runs * sizeof(PixelRuns::Run) + 10000);
}

TEST(PixelRuns, HaveCountsOfColumns) {
    // . x x
    // x x .
    PixelRuns pixels(3);
    for (const std::uint32_t pixel : {1U, 2U, 3U, 4U})
        pixels.add(pixel);
    EXPECT_EQ(runsOf(pixels), (Runs{{1, 3}, {3, 5}}));
    EXPECT_EQ(pixels.columnCounts(2), (Counts{1, 4, 1})) << "over the ends of columns";
    EXPECT_EQ(PixelRuns(3).columnCounts(2), (Counts{6}));
    PixelRuns corners(3);
    corners.add(0);
    corners.add(5);
    EXPECT_EQ(corners.columnCounts(2), (Counts{0, 1, 4, 1}));
    EXPECT_EQ(corners.box(), (Window{0, 0, 3, 2}));
    std::vector<std::uint8_t> bytes(6, 1);
    corners.fill(255, bytes);
    EXPECT_EQ(bytes, (std::vector<std::uint8_t>{255, 1, 1, 1, 1, 255}));
    EXPECT_TRUE(PixelRuns(3).box().empty());
}

TEST(Canvas, HasTheRaysOfThePictureInItsMiddle) {
    View view;
    view.width = 20;
    view.height = 10;
    view.crop = {4, 2, 12, 6};
    view.projection.half_width = 1;
    view.projection.half_height = 0.5;
    for (const int times : {1, 3, 9}) {
        Window picture;
        const View canvas = canvasOf(view, times, picture);
        EXPECT_EQ(canvas.crop.width(), 8 * times);
        EXPECT_EQ(canvas.crop.height(), 4 * times);
        EXPECT_EQ(picture.width(), 8);
        EXPECT_EQ(picture.height(), 4);
        EXPECT_EQ(picture.x0 - canvas.crop.x0, canvas.crop.x1 - picture.x1);
        EXPECT_GE(canvas.crop.x0, 0);
        EXPECT_LE(canvas.crop.x1, canvas.width);
        EXPECT_LE(canvas.crop.y1, canvas.height);
        for (const glm::dvec2 pixel : {glm::dvec2(0.5, 0.5), glm::dvec2(7.5, 3.5)}) {
            const glm::dvec3 here = worldPosition(view, 4 + pixel.x, 2 + pixel.y, 3);
            const glm::dvec3 there =
                worldPosition(canvas, picture.x0 + pixel.x, picture.y0 + pixel.y, 3);
            EXPECT_NEAR(glm::distance(here, there), 0, 1e-12) << times;
        }
    }
    view.width = view.crop.x1 = 40000;
    Window picture;
    EXPECT_THROW(canvasOf(view, 3, picture), Error);
}

}  // namespace
}  // namespace peeler::test
