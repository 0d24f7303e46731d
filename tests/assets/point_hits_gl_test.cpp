// SPDX-License-Identifier: Apache-2.0
// Compares the nearest hits before and after random points in real models with Embree's hits along
// the same rays.
#include <gtest/gtest.h>

#include <cmath>
#include <cstdio>
#include <random>

#include "core/fragments/supersampling.h"
#include "core/rays/point_hits.h"
#include "formats/gltf/gltf_reader.h"
#include "support/capture.h"
#include "support/embree_oracle.h"
#include "support/numbers.h"
#include "support/test_support.h"

namespace peeler::test {
namespace {

/// Shares of nearest hits whose distance agrees with Embree's. Errors are relative to the diagonal
/// of the scene's bounding box.
struct AgreeingShares {
    double coarse = 0;  ///< error of at most 1e-3
    double fine = 0;    ///< error of at most 1e-6
};

AgreeingShares agreement(const std::filesystem::path& file, int resolution, unsigned seed) {
    constexpr int kPoints = 4000, kDirections = 6;
    const Scene scene = readGltf(file);
    const PosedScene shown(scene);
    const Bounds all = shown.bounds().value();
    const double size = glm::distance(all.min, all.max);
    GlRenderer renderer(sharedContext(), shown);
    const TriangleSoup soup = soupOf(scene);
    AllHits oracle(soup);

    std::mt19937 random(seed);
    std::uniform_real_distribution<double> unit(0, 1);
    std::vector<glm::dvec3> points;
    for (int i = 0; i < kPoints; ++i)
        points.push_back(all.min + glm::dvec3(unit(random), unit(random), unit(random)) *
                                       (all.max - all.min));
    CaptureSettings settings;
    settings.hit_mode = HitMode::kRaw;
    settings.faces = Faces::kBoth;
    std::size_t compared = 0, coarse = 0, fine = 0, with_hit = 0;
    for (const glm::dvec3& direction : sphereDirections(kDirections)) {
        const Bundle bundle = parallelBundle("b", all, all, direction, {resolution});
        const Captured traced = capture(renderer, bundle.view, settings);
        std::vector<PointHits> found(points.size());
        findPointHits(shown, bundle, traced.image, points, found);
        for (std::size_t i = 0; i < points.size(); ++i) {
            double before = kInfinity, after = kInfinity;
            for (const float t : oracle(points[i] - size * direction, direction, false)) {
                const double along = static_cast<double>(t) - size;
                (along > 0 ? after : before) =
                    std::min(along > 0 ? after : before, std::abs(along));
            }
            const std::pair<double, double> sides[] = {{before, found[i].before.distance},
                                                       {after, found[i].after.distance}};
            for (const auto& [expected, distance] : sides) {
                ++compared;
                const bool is_hit = std::isfinite(expected);
                if (is_hit) ++with_hit;
                const double off = expected == distance ? 0 : std::abs(distance - expected) / size;
                if (off <= 1e-3) ++coarse;
                if (off <= 1e-6) ++fine;
            }
        }
    }
    const auto share = [&](std::size_t count) {
        return static_cast<double>(count) / static_cast<double>(compared);
    };
    std::printf(
        "%s, seed %u, %d rays across: %.2f %% have a hit, %.3f %% within 1e-3, %.3f %% "
        "within 1e-6\n",
        file.stem().c_str(), seed, resolution, 100 * share(with_hit), 100 * share(coarse),
        100 * share(fine));
    return {share(coarse), share(fine)};
}

TEST(PointHitsAgainstEmbree, OfRealModels) {
    PEELER_REQUIRE_ASSETS(assets);
    const std::filesystem::path models = assets / "gltf-sample-assets";
    const char* const kModels[] = {"Duck/glTF-Binary/Duck.glb",
                                   "DamagedHelmet/glTF-Binary/DamagedHelmet.glb"};
    unsigned seed = 60;
    for (const char* model : kModels) {
        const AgreeingShares at_1024 = agreement(models / model, 1024, ++seed);
        EXPECT_GE(at_1024.coarse, 0.993);
        EXPECT_GE(at_1024.fine, 0.97);
        const AgreeingShares at_256 = agreement(models / model, 256, seed);
        EXPECT_GE(at_256.coarse, 0.965);
    }
}

}  // namespace
}  // namespace peeler::test
