// SPDX-License-Identifier: Apache-2.0
// Tests that CPU hits do not depend on resources (threads, bands, memory budgets), on crops, or on
// the size of the picture.
#include "core/raster/hit_rasterizer.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <span>

#include <peeler/bundle.h>
#include <peeler/error.h>
#include "core/base/parallel.h"
#include "core/base/process_memory.h"
#include "support/closed_meshes.h"
#include "support/one_mesh.h"
#include "support/test_support.h"
#include "support/traced_hits.h"

namespace peeler::test {
namespace {

/// A sink that compares bands with the rows of a picture, bit for bit. It stores nothing, because
/// memory budgets include the test's own memory.
class ComparingSink final : public Sink {
  public:
    explicit ComparingSink(const LayeredImage& expected) : expected_(expected) {}
    void begin(const Plan&) override {}
    void finish() override {}
    void write(LayeredImage&& band) override {
        ++bands;
        const std::size_t pixel = expected_.pixelIndex(band.window.x0, band.window.y0);
        const std::uint32_t first = expected_.offsets[pixel];
        bool same = true;
        for (std::size_t p = 0; p < band.offsets.size(); ++p)
            same &= expected_.offsets[pixel + p] - first == band.offsets[p];
        same &= std::ranges::equal(std::span(expected_.z).subspan(first, band.z.size()), band.z);
        same &= sameData(expected_.color, band.color, first);
        for (std::size_t i = 0; i < band.extra.size(); ++i)
            same &= sameData(expected_.extra[i], band.extra[i], first);
        EXPECT_TRUE(same) << "rows " << band.window.y0 << " to " << band.window.y1;
        fragments += band.fragments();
    }
    std::size_t bands = 0, fragments = 0;

  private:
    static bool sameData(const FragmentArray& all, const FragmentArray& band, std::size_t first) {
        return std::ranges::equal(
            std::span(all.data).subspan(first * all.stride(), band.data.size()), band.data);
    }

    const LayeredImage& expected_;
};

class Threads {
  public:
    explicit Threads(int count) { setThreadCount(count); }
    ~Threads() { setThreadCount(0); }
};

class SameBytes : public testing::Test {
  protected:
    static Scene shells() {
        std::vector<Mesh> meshes;
        for (int i = 0; i < 12; ++i)
            meshes.push_back(
                {"", {placed(icosphere(5), 1.0F + 0.1F * static_cast<float>(i), {0, 0, 0})}});
        return sceneOf(meshes);
    }
    /// Captures, and compares with the expected picture. Returns the number of bands.
    std::size_t compare(HitRasterizer& source) {
        const CapturePlan plan = source.plan(view, settings);
        EXPECT_EQ(plan.layers.size(), expected.plan.layers.size());
        ComparingSink sink(expected.image);
        const CaptureReport report = source.capture(plan, sink);
        EXPECT_EQ(sink.fragments, expected.image.fragments());
        EXPECT_EQ(static_cast<std::size_t>(report.bands), sink.bands);
        return sink.bands;
    }
    void SetUp() override {
        settings.channels = {Channel::kNormal, Channel::kBarycentric};
        HitRasterizer source(posed);
        expected = trace(source, view, settings);
        EXPECT_EQ(source.sections(), 1U);
        ASSERT_GT(expected.image.fragments(), 400000U);
    }

    const Scene scene = shells();
    const PosedScene posed{scene};
    const View view = bundleOf(posed, {1, 2, 3}, 300).view;
    CaptureSettings settings = hitSettings(HitMode::kSloped);
    TracedHits expected;
};

TEST_F(SameBytes, OnOneThreadAndOnSeveral) {
    for (const int count : {1, 2, 3, 5}) {
        const Threads threads(count);
        HitRasterizer source(posed);
        compare(source);
    }
}

TEST_F(SameBytes, InBandsOfAnyHeight) {
    HitRasterizer source(posed);
    settings.band_bytes = 1 << 20;
    EXPECT_GT(compare(source), 20U);
    settings.band_bytes = 1 << 17;
    EXPECT_GT(compare(source), 150U);
}

/// The budget is too small for the coverage of all triangles at once, so the coverage is computed
/// section by section.
TEST(HitRasterizer, TheSameBytesUnderABudget) {
    if (kShadowMemory) GTEST_SKIP() << "its memory is not the product's";
    constexpr std::uint64_t kMebibyte = 1 << 20;
    Scene scene = sceneOf({{"", {icosphere(5)}}});
    scene.nodes[0].instances.emplace();
    for (int i = 0; i < 50; ++i)
        scene.nodes[0].instances->push_back(glm::scale(glm::dmat4(1), glm::dvec3(1 + 0.05 * i)));
    const PosedScene posed(scene);
    const View view = bundleOf(posed, {1, 2, 3}, 300).view;
    TracedHits expected;
    {
        HitRasterizer source(posed);
        expected = trace(source, view);
        EXPECT_EQ(source.sections(), 1U);
    }
    HitRasterizer source(posed);
    returnFreeMemory();
    CaptureSettings settings = hitSettings();
    // A budget that is too small, even if only by a little, must be refused before the first band.
    // The second successful capture starts with the memory that the first capture kept.
    int refused = 0, captured = 0;
    for (std::uint64_t more = 90 * kMebibyte; captured < 2; more += 2 * kMebibyte) {
        settings.memory = residentBytes() + more;
        ComparingSink sink(expected.image);
        try {
            const CapturePlan plan = source.plan(view, settings);
            EXPECT_EQ(plan.fragments_counted, expected.plan.fragments_counted);
            EXPECT_GT(source.sections(), 1U);
            source.capture(plan, sink);
        } catch (const Error& error) {
            ASSERT_EQ(error.kind(), ErrorKind::kMemory);
            EXPECT_EQ(sink.fragments, 0U);
            ++refused;
            continue;
        }
        EXPECT_EQ(sink.fragments, expected.image.fragments());
        ++captured;
    }
    EXPECT_GT(refused, 0);
}

TEST(HitRasterizer, WorksBesideAHostThatHoldsMoreThanTheBudget) {
    constexpr std::uint64_t kMebibyte = 1 << 20;
    const std::vector<std::uint8_t> of_host(500 * kMebibyte, 1);
    const Scene scene = sceneOf({{"", {torus(0.4, 64, 32)}}});
    const PosedScene posed(scene);
    const View view = bundleOf(posed, {1, 0.2, 0}, 90).view;
    HitRasterizer source(posed);
    CaptureSettings settings = hitSettings();
    settings.memory = 300 * kMebibyte;
    try {
        source.plan(view, settings);
        FAIL() << "the host's memory counts";
    } catch (const Error& error) {
        EXPECT_EQ(error.kind(), ErrorKind::kMemory);
    }
    settings.memory.base = residentBytes();
    EXPECT_GT(source.plan(view, settings).fragments_counted, 0U);
    EXPECT_EQ(of_host.back(), 1) << "it is resident until here";
}

TEST(HitRasterizer, ThePlanIsWhatIsCaptured) {
    const Scene scene = sceneOf({{"", {torus(0.4, 64, 32)}}});
    const PosedScene posed(scene);
    HitRasterizer source(posed);
    const TracedHits traced = trace(source, bundleOf(posed, {1, 0.2, 0}, 90).view);
    const auto counts = countsOf(traced.image);
    ASSERT_EQ(traced.plan.layers.size(), *std::ranges::max_element(counts));
    EXPECT_EQ(traced.plan.fragments_stored, traced.image.fragments());
    EXPECT_TRUE(traced.plan.complete());
    for (std::size_t layer = 0; layer < traced.plan.layers.size(); ++layer) {
        Window window;
        std::uint64_t pixels = 0;
        for (int y = 0; y < traced.plan.view.height; ++y) {
            for (int x = 0; x < traced.plan.view.width; ++x) {
                if (traced.image.count(traced.image.pixelIndex(x, y)) <= layer) continue;
                window = unite(window, {x, y, x + 1, y + 1});
                ++pixels;
            }
        }
        EXPECT_EQ(traced.plan.layers[layer].data_window, window);
        EXPECT_EQ(traced.plan.layers[layer].pixels, pixels);
    }
}

TEST(HitRasterizer, ACropHasTheHitsOfThePicture) {
    const Scene scene = sceneOf({{"", {icosphere(3)}}});
    const PosedScene posed(scene);
    HitRasterizer source(posed);
    View view = bundleOf(posed, {1, 2, 3}, 64).view;
    const TracedHits whole = trace(source, view);
    view.crop = {11, 20, 47, 53};
    const TracedHits part = trace(source, view);
    for (int y = view.crop.y0; y < view.crop.y1; ++y)
        for (int x = view.crop.x0; x < view.crop.x1; ++x)
            EXPECT_EQ(part.keys(part.image.pixelIndex(x, y)),
                      whole.keys(whole.image.pixelIndex(x, y)));
}

/// Returns a scene of `times` coincident triangles, which only one ray hits.
Scene triangleOver(std::size_t times) {
    Primitive primitive;
    primitive.positions = {{0.1F, -0.1F, -1}, {0.9F, -0.1F, -2}, {0.5F, -0.9F, -3}};
    primitive.indices.reserve(3 * times);
    for (std::size_t i = 0; i < times; ++i)
        primitive.indices.insert(primitive.indices.end(), {0, 1, 2});
    return oneMesh({primitive});
}

TEST(HitRasterizer, ManyTrianglesInOneRay) {
    const std::size_t triangles = exhaustive() ? 10'000'000 : 1'000'000;
    const Scene scene = triangleOver(triangles);
    HitRasterizer source{PosedScene(scene)};
    const TracedHits traced = trace(source, parallelView(1, 1));
    ASSERT_EQ(traced.image.fragments(), triangles);
    const auto keys = traced.image.extra.front().as<std::uint32_t>();
    EXPECT_TRUE(std::ranges::is_sorted(keys));
    EXPECT_EQ(traced.plan.layers.size(), triangles);
}

/// The hits of one row exceed the budget, and a row cannot be divided.
TEST(HitRasterizer, TooManyTrianglesInOneRayAreRefused) {
    if (kShadowMemory) GTEST_SKIP() << "its memory is not the product's";
    constexpr std::uint64_t kMebibyte = 1 << 20;
    const Scene scene = triangleOver(exhaustive() ? 10'000'000 : 4'000'000);
    HitRasterizer source{PosedScene(scene)};
    CaptureSettings settings = hitSettings();
    returnFreeMemory();
    const std::uint64_t before = residentBytes();
    settings.memory = before + 250 * kMebibyte;
    try {
        source.plan(parallelView(1, 1), settings);
        FAIL();
    } catch (const Error& error) {
        EXPECT_EQ(error.kind(), ErrorKind::kMemory);
        EXPECT_TRUE(contains(error.what(), "of one row")) << error.what();
        EXPECT_NE(error.hint(), "");
    }
    EXPECT_LE(residentBytes(), settings.memory);
}

TEST(HitRasterizer, BundlesOfOneRayAndOfManyOnASide) {
    const Scene scene = oneMesh({square(-10, -10, 70000, 70000, -1)});
    HitRasterizer source{PosedScene(scene)};
    EXPECT_EQ(trace(source, parallelView(1, 1)).image.fragments(), 1U);
    EXPECT_EQ(trace(source, parallelView(65536, 3)).image.fragments(), 3U * 65536);
    EXPECT_EQ(source.gridBits(), 14);
    EXPECT_EQ(trace(source, parallelView(2, 65536)).image.fragments(), 2U * 65536);
    try {
        trace(source, parallelView(65537, 1));
        FAIL();
    } catch (const Error& error) {
        EXPECT_EQ(error.kind(), ErrorKind::kUsage);
    }
    const Bounds box{glm::dvec3(0), glm::dvec3(1)};
    EXPECT_EQ(parallelBundle("b", box, box, {0, 0, -1}, {32768}).rays(), std::size_t{1} << 30);
    try {
        parallelBundle("b", box, box, {0, 0, -1}, {65536});
        FAIL();
    } catch (const Error& error) {
        EXPECT_EQ(error.kind(), ErrorKind::kUsage);
    }
}

/// A picture may have more rays than a 32-bit number can count. Few of these rays have hits.
TEST(HitRasterizer, AsManyRaysOnBothSides) {
    constexpr int kSide = 65536;
    const Scene scene = oneMesh({square(60000, 40000, 60003, 40005, -1), square(0, 0, 1, 1, -1),
                                 square(kSide - 1, kSide - 1, kSide, kSide, -2)});
    HitRasterizer source{PosedScene(scene)};
    class Counting final : public Sink {
      public:
        void begin(const Plan&) override {}
        void finish() override {}
        void write(LayeredImage&& band) override {
            hits += band.fragments();
            rays += band.window.pixels();
        }
        std::size_t hits = 0, rays = 0;
    };
    View view = parallelView(kSide, kSide);
    // Tracing all rows would take several seconds.
    if (!exhaustive()) view.crop = {0, 39990, kSide, 40010};
    const CapturePlan plan = source.plan(view, hitSettings());
    Counting sink;
    source.capture(plan, sink);
    EXPECT_EQ(sink.rays, view.crop.pixels());
    EXPECT_EQ(sink.hits, exhaustive() ? 17U : 15U);
    EXPECT_EQ(plan.fragments_counted, sink.hits);
    ASSERT_EQ(plan.layers.size(), 1U);
    EXPECT_EQ(plan.layers[0].data_window,
              exhaustive() ? view.crop : Window({60000, 40000, 60003, 40005}));
}

/// A band has at least one row, even if rows are wide and the sink stores much per pixel.
TEST(HitRasterizer, WideRowsOfSinksThatHoldMuchFit) {
    class Holding final : public Sink {
      public:
        void begin(const Plan&) override {}
        void finish() override {}
        void write(LayeredImage&& band) override { fragments += band.fragments(); }
        SinkMemory memory(const Plan&) const override { return {1, 0, 200, 1}; }
        std::size_t fragments = 0;
    };
    const Scene scene = oneMesh({square(-10, -10, 70000, 70000, -1)});
    HitRasterizer source{PosedScene(scene)};
    const CapturePlan plan = source.plan(parallelView(65536, 2), hitSettings());
    Holding sink;
    source.capture(plan, sink);
    EXPECT_EQ(sink.fragments, 2U * 65536);
}

TEST(HitRasterizer, PicturesAreRefused) {
    const Scene scene = oneMesh({square(0, 0, 4, 4, -1)});
    HitRasterizer source{PosedScene(scene)};
    for (int i = 0; i < 3; ++i) {
        CaptureSettings settings = hitSettings(i == 0 ? HitMode::kNone : HitMode::kRaw);
        if (i == 1) settings.samples = 4;
        if (i == 2) settings.clip.addBox({0, 0, 0}, {1, 1, 1});
        try {
            source.plan(parallelView(4, 4), settings);
            FAIL() << i;
        } catch (const Error& error) {
            EXPECT_EQ(error.kind(), ErrorKind::kInternal);
        }
    }
}

}  // namespace
}  // namespace peeler::test
