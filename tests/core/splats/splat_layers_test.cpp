// SPDX-License-Identifier: Apache-2.0
// Tests layers of Gaussian splats, against closed forms and against a reference in double
// precision.
#include <gtest/gtest.h>

#define IMATH_HALF_NO_LOOKUP_TABLE
#include <Imath/half.h>
#include <algorithm>
#include <cmath>
#include <glm/gtc/matrix_transform.hpp>
#include <glm/gtc/quaternion.hpp>
#include <limits>
#include <random>

#include <peeler/work.h>
#include "core/image/composite.h"
#include "core/splats/splat_layers.h"
#include "support/capture.h"
#include "support/splats.h"

namespace peeler::test {
namespace {

constexpr double kHarmonic0 = 0.28209479177387814;

/// A splat, as a test states it.
struct Blob {
    glm::dvec3 mean{0}, scale{0.1};
    glm::dquat turn{1, 0, 0, 0};
    double opacity = 0.5;
    glm::dvec3 color{0.5};  ///< sRGB
};

Scene sceneOfBlobs(const std::vector<Blob>& blobs, double dilation = 0, bool by_distance = false) {
    SceneBuilder builder;
    Primitive& primitive = addPoints(builder);
    const auto splats = std::make_shared<Splats>();
    splats->dilation = dilation;
    splats->by_distance = by_distance;
    for (const Blob& blob : blobs) {
        primitive.positions.emplace_back(blob.mean);
        splats->scales.emplace_back(blob.scale);
        splats->rotations.emplace_back(blob.turn.x, blob.turn.y, blob.turn.z, blob.turn.w);
        splats->opacities.push_back(static_cast<float>(blob.opacity));
        splats->harmonics.emplace_back((blob.color - 0.5) / kHarmonic0);
    }
    primitive.splats = splats;
    return builder.scene();
}

std::vector<Blob> randomBlobs(std::size_t count, unsigned seed) {
    std::mt19937 random(seed);
    std::uniform_real_distribution<double> share(0, 1);
    std::normal_distribution<double> normal;
    std::vector<Blob> blobs(count);
    for (Blob& blob : blobs) {
        blob.mean = {2 * share(random) - 1, 1.5 * share(random) - 0.75, -2 - 3 * share(random)};
        for (int k = 0; k < 3; ++k)
            blob.scale[k] = 0.01 * std::exp(3 * share(random));
        blob.turn = glm::normalize(
            glm::dquat(normal(random), normal(random), normal(random), normal(random)));
        blob.opacity = share(random);
        blob.color = {share(random), share(random), share(random)};
    }
    return blobs;
}

LayeredImage splatLayersOf(const Scene& scene, const View& view, const CaptureSettings& settings,
                           int rows = 1 << 20, bool every_processor = false) {
    const PosedScene posed(scene, 0);
    SplatLayers layers(posed, every_processor);
    layers.begin(view, settings);
    LayeredImage whole;
    CollectSink sink;
    for (int y = view.crop.y0; y < view.crop.y1; y += rows) {
        LayeredImage band;
        layers.capture({view.crop.x0, y, view.crop.x1, std::min(view.crop.y1, y + rows)}, band);
        sink.write(std::move(band));
    }
    return sink.image;
}

CaptureSettings floatColors(SplatOrder order = SplatOrder::kCenter) {
    CaptureSettings settings;
    settings.color_type = PixelType::kFloat;
    settings.splat_order = order;
    return settings;
}

TEST(SplatLayers, AreAGaussianOfTheProjectedSize) {
    // 48 pixels high, tan 0.5: a focal length of 48 pixels; at Z = 4, 0.25 units are 3 pixels.
    const View view = testView(64, 48);
    const LayeredImage image = splatLayersOf(
        sceneOfBlobs({{.mean = {0, 0, -4}, .scale = glm::dvec3(0.25), .opacity = 0.8}}), view,
        floatColors());
    for (int y = 0; y < 48; ++y) {
        for (int x = 0; x < 64; ++x) {
            const double dx = x + 0.5 - 32, dy = y + 0.5 - 24, square = (dx * dx + dy * dy) / 9;
            const double alpha = 0.8 * std::exp(-square / 2);
            const std::size_t pixel = image.pixelIndex(x, y);
            if (std::abs(square - 9) < 0.01 || std::abs(alpha * 255 - 1) < 0.01) continue;
            ASSERT_EQ(image.count(pixel), square < 9 && alpha > 1.0 / 255 ? 1U : 0U)
                << x << ' ' << y;
            if (image.count(pixel) == 0) continue;
            const std::uint32_t f = image.offsets[pixel];
            EXPECT_NEAR(color(image, f).a, alpha, 2e-6);
            EXPECT_NEAR(color(image, f).r, 0.21404114 * alpha, 2e-6);  // sRGB 0.5
            EXPECT_EQ(image.z[f], 4);
        }
    }
}

TEST(SplatLayers, AreNeverOpaqueAndAreDilated) {
    const View view = testView(64, 48);
    const Blob blob{.mean = {0, 0, -4}, .scale = glm::dvec3(1e-6), .opacity = 1};
    EXPECT_EQ(splatLayersOf(sceneOfBlobs({blob}), view, floatColors()).fragments(), 0U);
    // A variance of 4 square pixels, around the corner of four pixels.
    const LayeredImage dilated = splatLayersOf(sceneOfBlobs({blob}, 4), view, floatColors());
    const std::uint32_t f = dilated.offsets[dilated.pixelIndex(32, 24)];
    EXPECT_NEAR(color(dilated, f).a, std::exp(-0.5 * 0.5 / 4), 1e-4);
    CaptureSettings settings = floatColors();
    settings.splat_dilation = 1e4;
    const LayeredImage blurred = splatLayersOf(sceneOfBlobs({blob}, 4), view, settings);
    EXPECT_FLOAT_EQ(color(blurred, blurred.offsets[blurred.pixelIndex(32, 24)]).a, 0.99F);
}

/// A fragment of the reference.
struct WantedSplat {
    double z = 0, alpha = 0;
    std::size_t blob = 0;
};

/// Returns the fragments of a pixel, from formulas of the papers, in double precision. `unsure`:
/// set if rounding decides whether there is a fragment.
std::vector<WantedSplat> referenceFragments(const std::vector<Blob>& blobs, const View& view, int x,
                                            int y, double dilation, SplatOrder order,
                                            bool& unsure) {
    const double focal = view.height / (2 * view.projection.half_height);
    std::vector<WantedSplat> found;
    for (std::size_t i = 0; i < blobs.size(); ++i) {
        const Blob& blob = blobs[i];
        const glm::dvec3 at(blob.mean.x, -blob.mean.y, -blob.mean.z);
        const glm::dmat3 flip(1, 0, 0, 0, -1, 0, 0, 0, -1);
        glm::dmat3 spread(0);
        for (int k = 0; k < 3; ++k)
            spread[k][k] = blob.scale[k] * blob.scale[k];
        const glm::dmat3 turn = flip * glm::mat3_cast(blob.turn);
        const glm::dmat3 covariance = turn * spread * glm::transpose(turn);
        glm::dmat2 flat(0);
        const glm::dvec3 rows[2] = {{focal / at.z, 0, -focal * at.x / (at.z * at.z)},
                                    {0, focal / at.z, -focal * at.y / (at.z * at.z)}};
        for (int a = 0; a < 2; ++a)
            for (int b = 0; b < 2; ++b)
                flat[a][b] = glm::dot(rows[a], covariance * rows[b]) + (a == b ? dilation : 0);
        const glm::dvec2 off =
            glm::dvec2(x + 0.5, y + 0.5) -
            (glm::dvec2(view.width, view.height) / 2.0 + focal * glm::dvec2(at) / at.z);
        const double square = glm::dot(off, glm::inverse(flat) * off);
        const double alpha = std::min(0.99, blob.opacity * std::exp(-square / 2));
        unsure = unsure || std::abs(square - 9) < 1e-3 || std::abs(alpha * 255 - 1) < 1e-3;
        if (square > 9 || alpha < 1.0 / 255) continue;
        const glm::dvec3 ray((x + 0.5 - view.width / 2.0) / focal,
                             (y + 0.5 - view.height / 2.0) / focal, 1);
        const double pixel = at.z / focal;
        const glm::dvec3 widening = dilation * pixel * pixel * glm::dvec3(1, 1, 0);
        const glm::dmat3 precision =
            glm::inverse(covariance + glm::dmat3(widening.x, 0, 0, 0, widening.y, 0, 0, 0, 0));
        const double along = glm::dot(ray, precision * at) / glm::dot(ray, precision * ray);
        found.push_back({order == SplatOrder::kRay ? along : at.z, alpha, i});
    }
    std::ranges::stable_sort(found, {}, &WantedSplat::z);
    return found;
}

TEST(SplatLayers, EqualAReferenceInDoublePrecision) {
    const View view = testView(80, 60);
    const std::vector<Blob> blobs = randomBlobs(300, 1);
    for (const SplatOrder order : {SplatOrder::kCenter, SplatOrder::kRay}) {
        for (const double dilation : {0.0, 0.3}) {
            const LayeredImage image =
                splatLayersOf(sceneOfBlobs(blobs, dilation), view, floatColors(order));
            ASSERT_GT(image.fragments(), 10'000U);
            const auto keys = image.extra.front().as<std::uint32_t>();
            std::size_t unsure_pixels = 0, swapped = 0;
            for (int y = 0; y < 60; ++y) {
                for (int x = 0; x < 80; ++x) {
                    bool unsure = false;
                    const auto wanted =
                        referenceFragments(blobs, view, x, y, dilation, order, unsure);
                    const std::size_t pixel = image.pixelIndex(x, y);
                    unsure_pixels += unsure ? 1 : 0;
                    if (unsure) continue;
                    ASSERT_EQ(image.count(pixel), wanted.size()) << x << ' ' << y;
                    for (std::size_t i = 0; i < wanted.size(); ++i) {
                        const auto f = image.offsets[pixel] + static_cast<std::uint32_t>(i);
                        EXPECT_NEAR(image.z[f], wanted[i].z, 1e-5 * wanted[i].z);
                        if (keys[f] != wanted[i].blob + 1) {
                            ++swapped;  // equal Z but for rounding
                            continue;
                        }
                        EXPECT_NEAR(color(image, f).a, wanted[i].alpha, 1e-5);
                    }
                }
            }
            EXPECT_LT(unsure_pixels, 200U);
            EXPECT_LE(swapped, 4U);
        }
    }
}

/// Returns the Z at which the ray of a pixel of testView(64, 48) is this far from the camera.
double zAtDistance(double distance, int x, int y) {
    return distance / std::hypot((x + 0.5 - 32) / 48, (y + 0.5 - 24) / 48, 1);
}

TEST(SplatLayers, MayBeSortedByDistance) {
    const View view = testView(64, 48);
    const std::vector<Blob> blobs = {{.mean = {1.2, 0, -3}, .scale = glm::dvec3(0.5)},
                                     {.mean = {0, 0, -3.1}, .scale = glm::dvec3(0.5)}};
    for (const bool by_distance : {false, true}) {
        const LayeredImage image =
            splatLayersOf(sceneOfBlobs(blobs, 0, by_distance), view, floatColors());
        const auto keys = image.extra.front().as<std::uint32_t>();
        const std::size_t pixel = image.pixelIndex(40, 20);
        ASSERT_EQ(image.count(pixel), 2U);
        const std::uint32_t f = image.offsets[pixel];
        EXPECT_EQ(keys[f], by_distance ? 2U : 1U);
        EXPECT_NEAR(image.z[f], by_distance ? zAtDistance(3.1, 40, 20) : 3, 1e-6);
        EXPECT_NEAR(image.z[f + 1], by_distance ? zAtDistance(std::hypot(1.2, 3), 40, 20) : 3.1,
                    1e-6);
        // Parallel rays have no distance from a point.
        View parallel = view;
        parallel.projection.perspective = false;
        const LayeredImage flat =
            splatLayersOf(sceneOfBlobs(blobs, 0, by_distance), parallel, floatColors());
        const std::size_t middle = flat.pixelIndex(62, 24);
        ASSERT_EQ(flat.count(middle), 2U);
        EXPECT_EQ(flat.z[flat.offsets[middle]], 3);
    }
}

void expectInOrder(const LayeredImage& image) {
    const auto keys = image.extra.front().as<std::uint32_t>();
    for (std::size_t p = 0; p < image.window.pixels(); ++p)
        for (std::uint32_t f = image.offsets[p] + 1; f < image.offsets[p + 1]; ++f)
            ASSERT_LT(std::pair(image.z[f - 1], keys[f - 1]), std::pair(image.z[f], keys[f]));
}

TEST(SplatLayers, OfEqualZAreInDrawOrder) {
    // Distances that are no longer different after a division; the farthest is drawn first.
    std::vector<Blob> blobs;
    float distance = 3.99F;
    for (int i = 0; i < 8; ++i) {
        blobs.push_back({.mean = {0, 0, -distance}, .scale = glm::dvec3(2)});
        distance = std::nextafter(distance, 0.0F);
    }
    const View view = testView(64, 48);
    const LayeredImage image = splatLayersOf(sceneOfBlobs(blobs, 0, true), view, floatColors());
    ASSERT_EQ(image.fragments(), 8 * view.crop.pixels());
    expectInOrder(image);
}

/// A scene with splats sorted by Z and, in a second primitive, by distance.
Scene sceneOfBothOrders() {
    Scene scene = sceneOfBlobs(randomBlobs(300, 5), 0.3);
    const Scene others = sceneOfBlobs(randomBlobs(300, 6), 0.3, true);
    scene.meshes.back().primitives.push_back(others.meshes.back().primitives.front());
    return scene;
}

TEST(SplatLayers, SortedByDistanceAndByZAreSortedTogether) {
    const Scene scene = sceneOfBothOrders();
    const View view = testView(64, 48);
    const LayeredImage image = splatLayersOf(scene, view, floatColors());
    expectInOrder(image);
    const auto keys = image.extra.front().as<std::uint32_t>();
    for (std::size_t f = 0; f < image.fragments(); ++f) {
        const bool by_distance = keys[f] > 300;
        const Primitive& from = scene.meshes.back().primitives[by_distance ? 1 : 0];
        const glm::dvec3 mean(from.positions[(keys[f] - 1) % 300]);
        const auto pixel = static_cast<int>(
            std::ranges::upper_bound(image.offsets, static_cast<std::uint32_t>(f)) -
            image.offsets.begin() - 1);
        const double wanted =
            by_distance ? zAtDistance(glm::length(mean), pixel % 64, pixel / 64) : -mean.z;
        ASSERT_NEAR(image.z[f], wanted, 1e-6 * wanted);
    }
}

TEST(SplatLayers, DoNotDependOnBands) {
    const View view = testView(80, 60);
    const Scene scene = sceneOfBlobs(randomBlobs(300, 2), 0.3);
    for (const SplatOrder order : {SplatOrder::kCenter, SplatOrder::kRay}) {
        const LayeredImage whole = splatLayersOf(scene, view, floatColors(order));
        for (const int rows : {1, 7, 16})
            EXPECT_EQ(difference(whole, splatLayersOf(scene, view, floatColors(order), rows)), "")
                << rows;
    }
}

TEST(SplatLayers, AreTheSameOnEveryProcessor) {
    const View view = testView(83, 61);
    for (const Scene& scene : {sceneOfBothOrders(), sceneOfBlobs(randomBlobs(300, 8), 0.3, true)}) {
        for (const SplatOrder order : {SplatOrder::kCenter, SplatOrder::kRay}) {
            for (const bool tinted : {false, true}) {
                CaptureSettings settings;
                settings.splat_order = order;
                settings.tinted = tinted;
                const LayeredImage fast = splatLayersOf(scene, view, settings);
                EXPECT_EQ(difference(fast, splatLayersOf(scene, view, settings, 1 << 20, true)),
                          "");
                expectInOrder(fast);
            }
        }
    }
}

TEST(SplatLayers, RoundColoursToTheNearestHalf) {
    // From the least denormal half to the largest half.
    std::vector<Blob> blobs = randomBlobs(400, 9);
    std::mt19937 random(9);
    std::uniform_real_distribution<double> share(0, 1);
    for (Blob& blob : blobs) {
        blob.color = glm::dvec3(0.5);
        for (int c = 0; c < 3; ++c)
            blob.color[c] = std::exp2(-26 + 42 * share(random));
    }
    Scene scene = sceneOfBlobs(blobs);
    Primitive& primitive = scene.meshes.back().primitives.front();
    auto splats = std::make_shared<Splats>(*primitive.splats);
    splats->linear = true;
    primitive.splats = splats;
    const View view = testView(64, 48);
    for (const bool tinted : {false, true}) {
        CaptureSettings settings = floatColors();
        settings.tinted = tinted;
        const LayeredImage exact = splatLayersOf(scene, view, settings);
        settings.color_type = PixelType::kHalf;
        const LayeredImage rounded = splatLayersOf(scene, view, settings);
        const auto floats = exact.color.as<float>();
        const auto halfs = rounded.color.as<std::uint16_t>();
        ASSERT_EQ(floats.size(), halfs.size());
        for (std::size_t i = 0; i < floats.size(); ++i)
            ASSERT_EQ(halfs[i], imath_float_to_half(floats[i])) << floats[i];
    }
}

TEST(SplatLayers, DoNotDependOnBatches) {
    // More splats, or splats in more tiles, than a batch has. One thread takes whole rows of tiles.
    const struct {
        std::size_t splats;
        double width;
    } rows[] = {{40'000, 0.2}, {5'000, 20}};
    for (const auto& [splats, width] : rows) {
        std::mt19937 random(10);
        std::uniform_real_distribution<double> share(0, 1);
        std::vector<Blob> blobs(splats);
        for (Blob& blob : blobs) {
            blob.mean = {40 * share(random) - 20, 0, -2 - share(random)};
            blob.scale = {width, 1, 0.1};
        }
        View view = testView(1024, 24);
        view.projection.half_width = 20;
        view.crop = {0, 12, 1024, 13};
        const Scene scene = sceneOfBlobs(blobs);
        setThreadCount(1);
        const LayeredImage whole = splatLayersOf(scene, view, floatColors());
        setThreadCount(0);
        ASSERT_GT(whole.fragments(), 10 * splats);
        expectInOrder(whole);
        std::size_t fragments = 0;
        for (int x = 0; x < 1024; x += 61) {
            View part = view;
            part.crop.x0 = x;
            part.crop.x1 = std::min(x + 61, 1024);
            const LayeredImage image = splatLayersOf(scene, part, floatColors());
            EXPECT_TRUE(std::equal(image.z.begin(), image.z.end(),
                                   whole.z.begin() + static_cast<std::ptrdiff_t>(fragments)));
            fragments += image.fragments();
        }
        EXPECT_EQ(fragments, whole.fragments());
    }
}

TEST(SplatLayers, AreHiddenAtAndBehindAZ) {
    const View view = testView(64, 48);
    const Scene scene = sceneOfBothOrders();
    for (const SplatOrder order : {SplatOrder::kCenter, SplatOrder::kRay}) {
        SplatLayers layers{PosedScene(scene, 0)};
        layers.begin(view, floatColors(order));
        LayeredImage all;
        layers.capture(view.crop, all);
        // Each pixel is hidden from the Z of its third fragment.
        std::vector<float> hidden_from(view.crop.pixels(), std::numeric_limits<float>::infinity());
        for (std::size_t p = 0; p < hidden_from.size(); ++p)
            if (all.count(p) > 2) hidden_from[p] = all.z[all.offsets[p] + 2];
        std::vector<std::uint32_t> counts(hidden_from.size());
        layers.addCounts(view.crop, counts, hidden_from);
        LayeredImage image;
        layers.capture(view.crop, counts, image, hidden_from);
        for (std::size_t p = 0; p < hidden_from.size(); ++p) {
            ASSERT_EQ(counts[p], std::min(all.count(p), 2U));
            for (std::uint32_t k = 0; k < counts[p]; ++k)
                ASSERT_EQ(color(image, image.offsets[p] + k), color(all, all.offsets[p] + k));
        }
    }
}

/// Splats around the axis, one behind the other.
std::vector<Blob> stackOfBlobs(std::size_t count, double opacity, double bright_behind) {
    std::vector<Blob> blobs(count);
    for (std::size_t i = 0; i < count; ++i) {
        blobs[i].mean = {0, 0, -2 - 0.01 * static_cast<double>(i)};
        blobs[i].scale = glm::dvec3(0.7);
        blobs[i].opacity = opacity;
        blobs[i].color = glm::dvec3(i + 5 < count ? 0 : bright_behind);
    }
    return blobs;
}

TEST(SplatLayers, AreCompositedAsTheirLayersAre) {
    // Black in front of the brightest white, for opacities that leave alpha at 1 and short of it.
    std::vector<Scene> scenes = {sceneOfBlobs(randomBlobs(3000, 11), 0.3),
                                 sceneOfBlobs(randomBlobs(3000, 12), 0.3, true)};
    for (const double opacity : {0.99, 0.6, 0.3, 0.05}) {
        Scene scene = sceneOfBlobs(stackOfBlobs(100, opacity, 65504));
        Primitive& primitive = scene.meshes.back().primitives.front();
        auto splats = std::make_shared<Splats>(*primitive.splats);
        splats->linear = true;
        primitive.splats = splats;
        scenes.push_back(std::move(scene));
    }
    const View view = testView(70, 50);
    for (const Scene& scene : scenes) {
        for (const bool tinted : {false, true}) {
            for (const PixelType type : {PixelType::kHalf, PixelType::kFloat}) {
                for (const std::uint32_t limit : {0U, 1U, 7U}) {
                    CaptureSettings settings;
                    settings.tinted = tinted;
                    settings.color_type = type;
                    SplatLayers layers{PosedScene(scene, 0), limit == 1};
                    layers.begin(view, settings);
                    ASSERT_TRUE(layers.sameOrderEverywhere());
                    LayeredImage image;
                    layers.capture(view.crop, image);
                    CompositeImage wanted, composite;
                    compositeNearest(image, limit, Tail::kDrop, wanted);
                    layers.composite(view.crop, limit, composite);
                    EXPECT_EQ(composite.window, wanted.window);
                    EXPECT_EQ(composite.rgba, wanted.rgba);
                    EXPECT_EQ(composite.opacity, wanted.opacity);
                    EXPECT_EQ(composite.z, wanted.z);
                }
            }
        }
    }
}

TEST(SplatLayers, OfSeveralOrdersAreNotCompositedAtOnce) {
    const auto sameOrder = [](const Scene& scene, SplatOrder order) {
        SplatLayers layers{PosedScene(scene, 0)};
        layers.begin(testView(8, 8), floatColors(order));
        return layers.sameOrderEverywhere();
    };
    EXPECT_TRUE(sameOrder(sceneOfBlobs({{}, {}}), SplatOrder::kCenter));
    EXPECT_FALSE(sameOrder(sceneOfBlobs({{.mean = {0, 0, -1}}}), SplatOrder::kRay));
    EXPECT_FALSE(sameOrder(sceneOfBothOrders(), SplatOrder::kCenter));
}

TEST(SplatLayers, TurnWithTheirNode) {
    // Node and camera turned together show the same; colours, too.
    const View view = testView(40, 30);
    std::vector<Blob> blobs = randomBlobs(50, 3);
    Scene still = sceneOfBlobs(blobs), turned = sceneOfBlobs(blobs);
    for (Scene* const scene : {&still, &turned}) {
        Primitive& primitive = scene->meshes.back().primitives.front();
        auto splats = std::make_shared<Splats>(*primitive.splats);
        splats->degree = 3;
        splats->harmonics.clear();
        std::mt19937 random(4);
        std::normal_distribution<float> normal(0, 0.2F);
        for (std::size_t i = 0; i < blobs.size() * 16; ++i)
            splats->harmonics.emplace_back(normal(random), normal(random), normal(random));
        primitive.splats = splats;
    }
    const glm::dmat4 turn = glm::translate(
        glm::rotate(glm::dmat4(1), 1.1, glm::normalize(glm::dvec3(1, 2, 3))), {3, -2, 5});
    const PosedScene posed(turned, 0);
    Pose pose = restPose(turned);
    for (glm::dmat4& local : pose.locals)
        local = turn * local;
    View moved = view;
    moved.camera_to_world = turn * view.camera_to_world;
    SplatLayers layers(PosedScene(turned, 0, pose));
    layers.begin(moved, floatColors());
    LayeredImage image;
    layers.capture(moved.crop, image);
    const LayeredImage wanted = splatLayersOf(still, view, floatColors());
    ASSERT_NEAR(static_cast<double>(image.fragments()), static_cast<double>(wanted.fragments()), 3);
    if (image.fragments() != wanted.fragments()) return;
    for (std::size_t f = 0; f < image.fragments(); ++f)
        for (int c = 0; c < 4; ++c)
            ASSERT_NEAR(color(image, f)[c], color(wanted, f)[c], 2e-5) << f;
}

}  // namespace
}  // namespace peeler::test
