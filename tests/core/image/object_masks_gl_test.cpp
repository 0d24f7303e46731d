// SPDX-License-Identifier: Apache-2.0
// Tests object masks of captured scenes whose pixels are known.
#include <gtest/gtest.h>

#include <glm/gtc/matrix_transform.hpp>

#include "core/image/object_masks.h"
#include "support/capture.h"

namespace peeler::test {
namespace {

struct Found {
    std::vector<ObjectMasks> objects;
    Plan plan;
    int bands = 0;
};

/// Returns the masks of a captured scene. Each node, or each instance of a node, is an object.
Found masksOf(const Scene& scene, const View& view, int canvas = 1, float see_through = 0,
              std::uint64_t band_bytes = 384ULL << 20) {
    ObjectMaskOptions options{.see_through = see_through, .layers = true};
    const View seen = canvasOf(view, canvas, options.picture);
    ObjectTable table{.instances_apart = true, .numbers = {}, .objects = 0};
    for (const Node& node : scene.nodes) {
        table.numbers.push_back(table.objects + 1);
        table.objects += node.instances ? static_cast<std::uint32_t>(node.instances->size()) : 1;
    }
    CaptureSettings settings;
    settings.channels = {Channel::kId};
    settings.shading = Shading::kUnlit;
    settings.band_bytes = band_bytes;
    GlRenderer renderer(sharedContext(), PosedScene(scene));
    ObjectMaskSink sink(table, options);
    Found found;
    const CapturePlan plan = renderer.plan(seen, settings);
    found.plan = plan;
    sink.begin(plan);
    found.bands = renderer.capture(plan, sink).bands;
    sink.finish();
    found.objects = sink.objects();
    return found;
}

/// Returns the runs of pixels inside a window of a picture that is 16 pixels wide.
std::vector<PixelRuns::Run> block(const Window& window) {
    std::vector<PixelRuns::Run> runs;
    for (int y = window.y0; y < window.y1; ++y)
        runs.push_back({static_cast<std::uint32_t>(16 * y + window.x0),
                        static_cast<std::uint32_t>(16 * y + window.x1)});
    return runs;
}
std::vector<PixelRuns::Run> runsOf(const PixelRuns& pixels) {
    return {pixels.runs().begin(), pixels.runs().end()};
}

/// Returns two rectangles for a picture of 16 x 8 pixels. The first is opaque, at distance 2 (4
/// pixels per unit), and covers pixels [4, 12) x [2, 6). The second is half transparent, at
/// distance 1 (8 pixels per unit), and covers [8, 16) x [0, 8), which includes the right half of
/// the first.
SceneBuilder twoQuads() {
    SceneBuilder builder;
    const int opaque = builder.material({1, 0, 0, 1}, AlphaMode::kOpaque);
    const int glass = builder.material({0, 0, 1, 0.5F});
    builder.rectangle(1, 0.5F, -2, opaque);
    builder.quad({0, -0.5F, -1}, {1, -0.5F, -1}, {1, 0.5F, -1}, {0, 0.5F, -1}, glass);
    return builder;
}

TEST(CapturedMasks, OfTwoQuadsHaveKnownPixels) {
    const SceneBuilder builder = twoQuads();
    for (const std::uint64_t band_bytes : {std::uint64_t{384} << 20, std::uint64_t{4000}}) {
        const Found found = masksOf(builder.scene(), testView(16, 8), 1, 0, band_bytes);
        EXPECT_EQ(found.bands > 1, band_bytes == 4000) << found.bands;
        EXPECT_EQ(runsOf(found.objects[0].amodal), block({4, 2, 12, 6}));
        EXPECT_EQ(runsOf(found.objects[0].visible), block({4, 2, 8, 6}));
        EXPECT_EQ(runsOf(found.objects[1].amodal), block({8, 0, 16, 8}));
        EXPECT_EQ(runsOf(found.objects[1].visible), block({8, 0, 16, 8}));
        EXPECT_EQ(found.objects[0].visibleFraction(), 0.5);
        EXPECT_EQ(found.objects[1].visibleFraction(), 1);
    }
}

TEST(CapturedMasks, AreSeenThroughGlass) {
    const SceneBuilder builder = twoQuads();
    const Found at = masksOf(builder.scene(), testView(16, 8), 1, 0.5F);
    EXPECT_EQ(at.objects[0].visible.count(), 16U) << "what has just this opacity hides";
    const Found above = masksOf(builder.scene(), testView(16, 8), 1, 0.6F);
    EXPECT_EQ(runsOf(above.objects[0].visible), block({4, 2, 12, 6}));
    EXPECT_EQ(above.objects[1].visible.count(), 64U - 16);
    EXPECT_EQ(above.objects[1].amodal.count(), 64U);
}

TEST(CapturedMasks, OfACanvasCountWhatLiesBesideThePicture) {
    SceneBuilder builder;
    const int red = builder.material({1, 0, 0, 1}, AlphaMode::kOpaque);
    // The first object covers [12, 20) x [2, 6) at 8 pixels per unit, so half of it is inside the
    // picture. The second is left of the picture.
    builder.quad({0.5F, -0.25F, -1}, {1.5F, -0.25F, -1}, {1.5F, 0.25F, -1}, {0.5F, 0.25F, -1}, red);
    builder.quad({-2, -0.25F, -1}, {-1.5F, -0.25F, -1}, {-1.5F, 0.25F, -1}, {-2, 0.25F, -1}, red);
    const Found canvas = masksOf(builder.scene(), testView(16, 8), 3);
    EXPECT_EQ(canvas.objects[0].canvas_pixels, 32U);
    EXPECT_EQ(canvas.objects[0].canvas_box, (Window{12, 2, 20, 6}));
    EXPECT_EQ(runsOf(canvas.objects[0].amodal), block({12, 2, 16, 6}));
    EXPECT_EQ(canvas.objects[0].visibleFraction(), 0.5);
    EXPECT_EQ(canvas.objects[1].canvas_pixels, 16U);
    EXPECT_EQ(canvas.objects[1].canvas_box, (Window{-8, 2, -4, 6}));
    EXPECT_EQ(canvas.objects[1].amodal.count(), 0U);
    const Found picture = masksOf(builder.scene(), testView(16, 8));
    EXPECT_EQ(picture.objects[0].canvas_pixels, 16U);
    EXPECT_EQ(picture.objects[0].visibleFraction(), 1);
    EXPECT_EQ(runsOf(picture.objects[0].amodal), runsOf(canvas.objects[0].amodal));
    EXPECT_EQ(picture.objects[1].canvas_pixels, 0U);
}

TEST(CapturedMasks, OfACropAreThoseOfItsPixels) {
    const SceneBuilder builder = twoQuads();
    View view = testView(16, 8);
    view.crop = {6, 1, 14, 5};
    for (const int canvas : {1, 3}) {
        const Found found = masksOf(builder.scene(), view, canvas);
        EXPECT_EQ(found.objects[0].amodal.box(), (Window{0, 1, 6, 4}));
        EXPECT_EQ(found.objects[0].visible.box(), (Window{0, 1, 2, 4}));
        EXPECT_EQ(found.objects[1].visible.box(), (Window{2, 0, 8, 4}));
        // The canvas contains the whole scene. Coordinates are relative to the crop's corner.
        EXPECT_EQ(found.objects[0].canvas_box,
                  canvas == 3 ? (Window{-2, 1, 6, 5}) : (Window{0, 1, 6, 4}));
    }
}

TEST(CapturedMasks, OfInstancesAreApart) {
    SceneBuilder builder;
    const int red = builder.material({1, 0, 0, 1}, AlphaMode::kOpaque);
    const int node = builder.rectangle(0.25F, 0.25F, -1, red);
    builder.scene().nodes[static_cast<std::size_t>(node)].instances = {
        glm::translate(glm::dmat4(1), glm::dvec3(-0.5, 0, 0)),
        glm::translate(glm::dmat4(1), glm::dvec3(0.5, 0, 0))};
    builder.rectangle(1, 0.5F, -2, red);
    const Found found = masksOf(builder.scene(), testView(16, 8));
    ASSERT_EQ(found.objects.size(), 3U);
    EXPECT_EQ(runsOf(found.objects[0].amodal), block({2, 2, 6, 6}));
    EXPECT_EQ(runsOf(found.objects[1].amodal), block({10, 2, 14, 6}));
    EXPECT_EQ(runsOf(found.objects[2].amodal), block({4, 2, 12, 6}));
    EXPECT_EQ(runsOf(found.objects[2].visible), block({6, 2, 10, 6}));
}

}  // namespace
}  // namespace peeler::test
