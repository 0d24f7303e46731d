// SPDX-License-Identifier: Apache-2.0
// Compares GL's hits with the CPU's hits.
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <cstdio>
#include <iterator>
#include <numeric>
#include <vector>

#include <peeler/bundle.h>
#include "core/bake/receivers.h"
#include "core/raster/hit_rasterizer.h"
#include "core/scene/elements.h"
#include "core/scene/view.h"
#include "support/capture.h"
#include "support/edge_distance.h"
#include "support/hard_scenes.h"

namespace peeler::test {
namespace {

// The largest snapping error, in ray spacings: GL snaps vertices to a grid of 1/256, the CPU to a
// grid of 1/65,536.
constexpr double kSnapped = 1.0 / 256 + 1.0 / 65536;

struct KeyedHit {
    std::uint32_t key = 0;
    float z = 0;
};

/// Returns the hits of a ray, sorted by their keys. Each key occurs once.
std::vector<KeyedHit> hitsOf(const LayeredImage& image, std::size_t ray) {
    const auto keys = image.extra.front().as<const std::uint32_t>();
    std::vector<KeyedHit> hits;
    for (std::uint32_t f = image.offsets[ray]; f < image.offsets[ray + 1]; ++f)
        hits.push_back({keys[f], image.z[f]});
    std::ranges::sort(hits, {}, &KeyedHit::key);
    return hits;
}

/// Returns the outline of a triangle in ray coordinates. For a camera, clips the triangle at the
/// near plane.
std::vector<glm::dvec2> outlineOf(const PosedScene& posed, const View& view, std::uint32_t key) {
    WorldElement element = elementOf(posed, key);
    placeCorners(posed, element);
    const glm::dmat4 camera_from_world = glm::inverse(view.camera_to_world);
    const PixelRays rays(view);
    std::vector<glm::dvec3> corners;
    for (const glm::dvec3& corner : element.corner)
        corners.emplace_back(camera_from_world * glm::dvec4(corner, 1));
    std::vector<glm::dvec2> outline;
    for (std::size_t i = 0; i < corners.size(); ++i) {
        const glm::dvec3 &a = corners[i], &b = corners[(i + 1) % corners.size()];
        // at_a and at_b are the corners' depths beyond the near plane.
        const double near = rays.perspective() ? view.projection.near : -HUGE_VAL;
        const double at_a = -a.z - near, at_b = -b.z - near;
        if (at_a >= 0) outline.push_back(rays.pixel(a));
        if (std::isfinite(near) && (at_a >= 0) != (at_b >= 0))
            outline.push_back(rays.pixel(glm::mix(a, b, at_a / (at_a - at_b))));
    }
    return outline;
}

/// Returns the distance between a ray of a capture and the edges of a triangle, in ray spacings.
double rayToEdge(const PosedScene& posed, const View& view, const LayeredImage& image,
                 std::size_t ray, std::uint32_t key) {
    const auto width = static_cast<std::size_t>(image.window.width());
    const glm::dvec2 at(image.window.x0 + static_cast<int>(ray % width),
                        image.window.y0 + static_cast<int>(ray / width));
    return distanceToEdges(outlineOf(posed, view, key), at + view.sample);
}

/// The agreement of two captures of the same rays.
struct Agreement {
    std::size_t rays = 0, hits = 0;
    std::size_t differing = 0;  ///< rays on which the sets of triangles differ
    /// The greatest distance, in ray spacings, from a ray to the edges of a triangle that the ray
    /// hits in only one of the captures.
    double farthest = 0;
    /// The greatest error of Z on rays with equal sets of triangles, relative to the scene's size.
    double largest_error = 0;
};

void compare(const PosedScene& posed, const View& view, const LayeredImage& gl,
             const LayeredImage& cpu, Agreement& agreement) {
    ASSERT_EQ(gl.window, cpu.window);
    const Bounds box = *posed.bounds();
    const double size = glm::length(box.max - box.min);
    for (std::size_t ray = 0; ray < gl.window.pixels(); ++ray) {
        const std::vector<KeyedHit> here = hitsOf(gl, ray), there = hitsOf(cpu, ray);
        std::vector<KeyedHit> either;
        std::ranges::set_symmetric_difference(here, there, std::back_inserter(either), {},
                                              &KeyedHit::key, &KeyedHit::key);
        ++agreement.rays;
        agreement.hits += here.size();
        if (!either.empty()) ++agreement.differing;
        for (const KeyedHit& hit : either)
            agreement.farthest =
                std::max(agreement.farthest, rayToEdge(posed, view, gl, ray, hit.key));
        if (!either.empty()) continue;
        for (std::size_t i = 0; i < here.size(); ++i) {
            const double error = static_cast<double>(std::abs(here[i].z - there[i].z)) / size;
            // Near an edge a ray may miss the exact triangle, which then has no exact depth for the
            // ray.
            if (error > agreement.largest_error &&
                rayToEdge(posed, view, gl, ray, here[i].key) > kSnapped)
                agreement.largest_error = error;
        }
    }
}

/// Returns a camera and bundles. The camera's near plane is inside most scenes.
std::vector<View> viewsOf(const Bounds& box) {
    std::vector<View> views{testView(160, 120)};
    RayGrid grid;
    grid.resolution = 160;
    for (const glm::dvec3& direction : sphereDirections(3))
        views.push_back(parallelBundle("b", box, box, direction, grid).view);
    views.push_back(parallelBundle("b", box, box, {0, 0, -1}, grid).view);
    return views;
}

TEST(HitSources, AgreeOnHardScenesButAtEdges) {
    for (const auto& [name, scene] : hardScenes()) {
        const PosedScene posed(scene);
        GlRenderer gl(sharedContext(), posed);
        HitRasterizer cpu(posed);
        for (const HitMode mode : {HitMode::kRefined, HitMode::kRaw}) {
            Agreement agreement;
            for (const View& view : viewsOf(*posed.bounds())) {
                CaptureSettings settings;
                settings.hit_mode = mode;
                settings.faces = Faces::kBoth;
                settings.color_type = PixelType::kFloat;
                settings.depth_clamp = !view.projection.perspective;
                const Captured here = capture(gl, view, settings);
                const Captured there = capture(cpu, view, settings);
                EXPECT_EQ(there.plan.fragments_counted, there.image.fragments()) << name;
                EXPECT_EQ(there.plan.channel_bytes, here.plan.channel_bytes) << name;
                compare(posed, view, here.image, there.image, agreement);
            }
            std::printf(
                "%s, %s: of %zu rays with %zu hits %zu hit other triangles, at most %.5f rays from "
                "their edges; largest error of Z %.2g of the size\n",
                name, mode == HitMode::kRaw ? "raw" : "refined", agreement.rays, agreement.hits,
                agreement.differing, agreement.farthest, agreement.largest_error);
            EXPECT_GT(agreement.hits, agreement.rays / 2) << name;
            EXPECT_LE(agreement.differing, agreement.rays / 20) << name;
            EXPECT_LE(agreement.farthest, kSnapped) << name;
            // Raw depths have only 32 bits, so their errors are larger.
            if (mode == HitMode::kRaw) continue;
            EXPECT_LE(agreement.largest_error, 1e-6) << name;
        }
    }
}

/// Hits that both captures find must have the same channels, except near edges, where a ray may
/// miss the exact triangle.
TEST(HitSources, SayTheSameOfTheSameHits) {
    SceneBuilder builder;
    const int material = builder.material(glm::vec4(1));
    builder.sphere({0, 0, -3}, 1, material);
    builder.rectangle(0.7F, 0.4F, -2.5F, material);
    const PosedScene posed(builder.scene());
    const Bounds box = *posed.bounds();
    RayGrid grid;
    grid.resolution = 120;
    const View view = parallelBundle("b", box, box, {1, 2, -3}, grid).view;
    CaptureSettings settings;
    settings.hit_mode = HitMode::kRefined;
    settings.faces = Faces::kBoth;
    settings.color_type = PixelType::kFloat;
    settings.depth_clamp = true;
    settings.channels = {
        Channel::kNormal,    Channel::kGeometricNormal, Channel::kFacing,
        Channel::kId,        Channel::kBarycentric,     Channel::kDistance,
        Channel::kBaseColor, Channel::kEmissive,        Channel::kRoughnessMetallic};
    std::ranges::sort(settings.channels);
    GlRenderer renderer(sharedContext(), posed);
    HitRasterizer rasterizer(posed);
    const LayeredImage gl = capture(renderer, view, settings).image;
    const LayeredImage cpu = capture(rasterizer, view, settings).image;
    ASSERT_EQ(gl.extra.size(), cpu.extra.size());
    for (std::size_t i = 0; i < gl.extra.size(); ++i) {
        EXPECT_EQ(gl.extra[i].channels, cpu.extra[i].channels);
        EXPECT_EQ(gl.extra[i].type, cpu.extra[i].type);
    }
    const auto gl_keys = gl.extra[0].as<const std::uint32_t>();
    const auto cpu_keys = cpu.extra[0].as<const std::uint32_t>();
    std::size_t compared = 0;
    for (std::size_t ray = 0; ray < gl.window.pixels(); ++ray) {
        if (gl.count(ray) != cpu.count(ray)) continue;
        for (std::uint32_t k = 0; k < gl.count(ray); ++k) {
            const std::uint32_t a = gl.offsets[ray] + k, b = cpu.offsets[ray] + k;
            if (gl_keys[a] != cpu_keys[b]) continue;
            if (rayToEdge(posed, view, gl, ray, gl_keys[a]) <= kSnapped) continue;
            ++compared;
            for (std::size_t i = 1; i < gl.extra.size(); ++i) {
                for (std::size_t c = 0; c < gl.extra[i].components(); ++c) {
                    const float here = FragmentChannel(gl.extra[i], c).value(a);
                    const float there = FragmentChannel(cpu.extra[i], c).value(b);
                    // GL computes normals in a shader, from snapped vertices; hence the tolerance.
                    ASSERT_NEAR(here, there, 1e-3) << gl.extra[i].channels[c] << ", ray " << ray;
                }
            }
        }
    }
    EXPECT_GT(compared, 10'000U);
}

/// A source that prefers bundles and gets its hits from another source.
class BundlesOf final : public HitSource {
  public:
    explicit BundlesOf(HitSource& source) : source_(source) {}
    CapturePlan plan(const View& view, const CaptureSettings& settings,
                     const Progress& progress) override {
        return source_.plan(view, settings, progress);
    }
    CaptureReport capture(const CapturePlan& plan, Sink& sink, const Progress& progress) override {
        return source_.capture(plan, sink, progress);
    }
    std::uint64_t forecastMemory(const CapturePlan& plan, const Sink& sink) override {
        return source_.forecastMemory(plan, sink);
    }
    const PosedScene& posed() const override { return source_.posed(); }
    StageTimes takeTimes() override { return source_.takeTimes(); }

  private:
    HitSource& source_;
};

TEST(HitSources, BakeTheSame) {
    SceneBuilder builder;
    const int material = builder.material(glm::vec4(1), AlphaMode::kOpaque);
    builder.sphere({0, 1.2F, 0}, 1, material);
    builder.quad({-3, 0, 3}, {3, 0, 3}, {3, 0, -3}, {-3, 0, -3}, material);
    const PosedScene posed(builder.scene());
    const VertexReceivers vertices(posed);
    BakeSettings settings;
    settings.directions = 64;
    CaptureSettings capture;
    capture.faces = Faces::kBoth;
    const auto bakedBy = [&](HitSource& source, int resolution) {
        settings.resolution = resolution;
        return bake(source, vertices.receivers(), settings, capture, vertices.lookup(), {});
    };
    GlRenderer renderer(sharedContext(), posed);
    HitRasterizer rasterizer(posed);
    BundlesOf bundles(rasterizer);
    const std::vector<float> gl = bakedBy(renderer, 128), cpu = bakedBy(bundles, 128);
    const std::vector<float> finer = bakedBy(renderer, 1024), lines = bakedBy(rasterizer, 0);
    const auto count = static_cast<double>(gl.size());
    const double mean = std::accumulate(gl.begin(), gl.end(), 0.0) / count;
    EXPECT_GT(mean, 0.2);
    EXPECT_LT(mean, 0.95);
    const auto apart = [&](const std::vector<float>& a, const std::vector<float>& b) {
        EXPECT_EQ(a.size(), b.size());
        double sum = 0;
        for (std::size_t i = 0; i < a.size(); ++i)
            sum += static_cast<double>(std::abs(a[i] - b[i])) / count;
        return sum;
    };
    const double same_rays = apart(gl, cpu), coarse = apart(gl, lines), fine = apart(finer, lines);
    std::printf("ambient occlusion: %.5f apart in the mean; from lines of their own %.5f, %.5f\n",
                same_rays, coarse, fine);
    EXPECT_LE(same_rays, 0.0005);
    // Finer bundles approximate the receivers' individual rays better.
    EXPECT_LE(coarse, 0.01);
    EXPECT_LE(fine, coarse / 2);
}

}  // namespace
}  // namespace peeler::test
