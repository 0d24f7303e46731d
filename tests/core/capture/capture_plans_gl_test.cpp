// SPDX-License-Identifier: Apache-2.0
// Tests that capture plans are independent values: they can be captured later, in another order,
// and repeatedly.
#include <gtest/gtest.h>

#include <string>
#include <vector>

#include <peeler/bundle.h>
#include <peeler/error.h>
#include "core/capture/gl_renderer.h"
#include "support/capture.h"
#include "support/closed_meshes.h"
#include "support/traced_hits.h"

namespace peeler::test {
namespace {

/// Captures each plan twice, in a mixed order. Compares the pictures with immediate captures.
void expectTheSameInAnyOrder(HitSource& source, const std::vector<View>& views,
                             const std::vector<CaptureSettings>& settings) {
    std::vector<Captured> expected;
    std::vector<CapturePlan> plans;
    for (std::size_t i = 0; i < views.size(); ++i)
        expected.push_back(capture(source, views[i], settings[i]));
    for (std::size_t i = 0; i < views.size(); ++i)
        plans.push_back(source.plan(views[i], settings[i]));
    std::vector<std::size_t> order;
    for (std::size_t i = 0; i < views.size(); ++i) {
        order.push_back(views.size() - 1 - i);
        order.push_back(i);
    }
    for (const std::size_t i : order) {
        CollectSink sink;
        EXPECT_GT(source.forecastMemory(plans[i], sink), 0U);
        const CaptureReport report = source.capture(plans[i], sink);
        EXPECT_EQ(difference(sink.image, expected[i].image), "") << i;
        EXPECT_EQ(report.passes, expected[i].report.passes) << i;
    }
}

class CapturePlans : public testing::TestWithParam<const char*> {};
INSTANTIATE_TEST_SUITE_P(By, CapturePlans, testing::Values("cpu", "gl"),
                         [](const auto& row) { return std::string(row.param); });

TEST_P(CapturePlans, OfBundles) {
    const Scene scene = sceneOf({{"", {torus(0.4, 64, 32)}}});
    const PosedScene posed(scene);
    const auto source = openHits(GetParam(), posed);
    std::vector<View> views;
    for (const glm::dvec3& direction : {glm::dvec3{1, 0.2, 0}, {0, 1, 0}, {-2, 1, 0.5}}) {
        const Bounds all = posed.bounds().value();
        views.push_back(parallelBundle("", all, all, direction, {90}).view);
    }
    expectTheSameInAnyOrder(*source, views, std::vector(3, hitSettings()));
}

TEST_P(CapturePlans, OfAnotherSourceAreRefused) {
    const Scene scene = sceneOf({{"", {torus(0.4, 16, 8)}}});
    const PosedScene posed(scene);
    const auto source = openHits(GetParam(), posed);
    const auto other = openHits(GetParam() == std::string("cpu") ? "gl" : "cpu", posed);
    const Bounds all = posed.bounds().value();
    const View view = parallelBundle("", all, all, {0, 1, 0}, {20}).view;
    CollectSink sink;
    try {
        source->capture(other->plan(view, hitSettings()), sink);
        FAIL();
    } catch (const Error& error) {
        EXPECT_EQ(error.kind(), ErrorKind::kInternal);
    }
}

TEST(PicturePlans, OfLayersCompositesAndSamplesInAnyOrder) {
    Scene scene = sceneOf({{"", {torus(0.4, 64, 32)}}});
    for (Material& material : scene.materials)
        material.alpha_mode = AlphaMode::kOpaque;
    GlRenderer renderer(sharedContext(), PosedScene(scene, 0));
    View view = testView(64, 48);
    view.camera_to_world[3].z = 4;
    std::vector<CaptureSettings> settings(4);
    settings[1].composite = true;  // the plan keeps the composited bands
    settings[2].samples = 4;       // the plan keeps the merged bands
    settings[3].max_layers = 1;
    settings[3].shadows = true;
    expectTheSameInAnyOrder(renderer, std::vector(4, view), settings);
}

}  // namespace
}  // namespace peeler::test
