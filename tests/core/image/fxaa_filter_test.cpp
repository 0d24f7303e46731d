// SPDX-License-Identifier: Apache-2.0
// Tests the FXAA filter as a sink between renderer and writer: bands, threads, memory.
#include "core/image/fxaa.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <random>

#include "core/base/parallel.h"

namespace peeler {
namespace {

/// A sink that keeps the filtered picture.
class Canvas : public Sink {
  public:
    void begin(const Plan& plan) override {
        crop = plan.view.crop;
        image = {{crop.x0, crop.y0, crop.x1, crop.y0}, {}, {}};
    }
    void write(LayeredImage&& band) override {
        EXPECT_EQ(band.window.y0, image.window.y1);
        EXPECT_EQ(band.window.x0, crop.x0);
        EXPECT_EQ(band.window.x1, crop.x1);
        EXPECT_GT(band.window.height(), 0);
        CompositeImage rows;
        compositeOver(band, {}, rows);
        image.appendRows(rows, band.window.y0, band.window.y1);
        image.window.y1 = band.window.y1;
    }
    void finish() override { finished = true; }
    SinkMemory memory(const Plan&) const override { return {15, 1000}; }
    StageTimes times() const override { return {{"encode", 7.0}}; }

    Window crop;
    CompositeImage image;
    bool finished = false;
};

/// A sink that forwards bands to another sink, which outlives it.
class Borrowed : public Sink {
  public:
    explicit Borrowed(Sink& sink) : sink_(sink) {}
    void begin(const Plan& plan) override { sink_.begin(plan); }
    void write(LayeredImage&& band) override { sink_.write(std::move(band)); }
    void finish() override { sink_.finish(); }
    SinkMemory memory(const Plan& plan) const override { return sink_.memory(plan); }
    StageTimes times() const override { return sink_.times(); }

  private:
    Sink& sink_;
};

/// Returns rows [y0, y1) of a test picture: two layers of slanted edges on an empty background,
/// with holes. One edge is so steep that the search finds the ends of its steps at all distances.
LayeredImage slantedBand(const Window& crop, int y0, int y1) {
    LayeredImage image;
    image.window = {crop.x0, y0, crop.x1, y1};
    image.color = {{"R", "G", "B", "A"}, PixelType::kFloat, {}};
    image.offsets = {0};
    std::vector<std::array<float, 4>> colors;
    const auto add = [&](float value, float alpha, float z) {
        colors.push_back({value * alpha, value * alpha, value * alpha, alpha});
        image.z.push_back(z);
    };
    for (int y = y0; y < y1; ++y) {
        for (int x = crop.x0; x < crop.x1; ++x) {
            if (33 * x > 990 + y && (x * y) % 97 != 0) add(0.9F, 0.5F, 2);
            if (30 * y > 1500 + x) add(0.1F, 1, 3);
            image.offsets.push_back(static_cast<std::uint32_t>(image.z.size()));
        }
    }
    const auto* bytes = reinterpret_cast<const std::byte*>(colors.data());
    image.color.data.assign(bytes, bytes + colors.size() * sizeof colors.front());
    return image;
}

/// Returns the picture filtered in bands of at most `rows` rows (0: any number).
Canvas filteredInBands(const Window& crop, int rows, const std::array<float, 4>& background = {}) {
    Canvas canvas;
    FxaaFilter filter(std::make_unique<Borrowed>(canvas), background);
    Plan plan;
    plan.view.crop = crop;
    filter.begin(plan);
    std::mt19937 random(5);
    for (int y = crop.y0; y < crop.y1;) {
        const int height = rows ? rows : 1 + static_cast<int>(random() % 60U);
        const int end = std::min(y + height, crop.y1);
        filter.write(slantedBand(crop, y, end));
        y = end;
    }
    EXPECT_FALSE(canvas.finished);
    filter.finish();
    EXPECT_TRUE(canvas.finished);
    EXPECT_EQ(filter.times().at("encode"), 7.0);
    return canvas;
}

CompositeImage expected(const Window& crop, const std::array<float, 4>& background = {}) {
    CompositeImage whole, out;
    compositeOver(slantedBand(crop, crop.y0, crop.y1), {}, whole);
    applyFxaa(whole, background, crop.y0, crop.y1, out);
    EXPECT_NE(out.rgba, whole.rgba);
    return out;
}

void expectSamePicture(const CompositeImage& a, const CompositeImage& b) {
    EXPECT_EQ(a.window, b.window);
    EXPECT_TRUE(a.rgba == b.rgba);
    EXPECT_TRUE(a.z == b.z);
}

TEST(FxaaFilter, BandsChangeNothing) {
    // The first crop has more rows than a slice of the filter; the others have fewer rows than the
    // overlap of bands.
    for (const Window& crop : {Window{-5, 7, 90, 407}, Window{0, 45, 80, 55}, Window{3, 3, 4, 4}}) {
        CompositeImage whole, once;
        compositeOver(slantedBand(crop, crop.y0, crop.y1), {}, whole);
        applyFxaa(whole, {}, crop.y0, crop.y1, once);
        for (const int rows : {0, 1, 16, 33, 1000})
            expectSamePicture(filteredInBands(crop, rows).image, once);
    }
}

TEST(FxaaFilter, ThreadsChangeNothing) {
    const Window crop{0, 0, 90, 150};
    const CompositeImage once = expected(crop);
    for (const int threads : {1, 5}) {
        setThreadCount(threads);
        expectSamePicture(filteredInBands(crop, 40).image, once);
    }
    setThreadCount(0);
}

TEST(FxaaFilter, FiltersForTheBackground) {
    const Window crop{0, 0, 90, 90};
    const std::array<float, 4> dark{0.1F, 0.1F, 0.1F, 1};
    const Canvas canvas = filteredInBands(crop, 20, dark);
    expectSamePicture(canvas.image, expected(crop, dark));
    EXPECT_NE(canvas.image.rgba, expected(crop).rgba);
}

TEST(FxaaFilter, SaysWhatItKeeps) {
    const auto memory = [](int width) {
        Canvas canvas;
        FxaaFilter filter(std::make_unique<Borrowed>(canvas), {});
        Plan plan;
        plan.view.crop = {0, 0, width, 1000};
        EXPECT_EQ(filter.memory(plan).rows, 15);
        return filter.memory(plan).bytes;
    };
    // The filter keeps at least 2 · kFxaaReach rows. Each pixel has 7 floats: colour, Z and two
    // lumas.
    EXPECT_GT(memory(640), 1000 + 640 * 2 * kFxaaReach * 7 * sizeof(float));
    EXPECT_LT(memory(3840), 64U << 20);
    EXPECT_GT(memory(65536), 65536 * 2 * kFxaaReach * 7 * sizeof(float));
    EXPECT_LT(memory(65536), 256U << 20);
}

}  // namespace
}  // namespace peeler
