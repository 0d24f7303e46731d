// SPDX-License-Identifier: Apache-2.0
// Compares CPU hits of real models with an independent oracle, and checks that rays leave each
// solid that they enter. Needs no GL.
#include <gtest/gtest.h>

#include <cstdio>
#include <filesystem>
#include <span>

#include "assets/model_files.h"
#include "core/raster/hit_rasterizer.h"
#include "core/rays/solids.h"
#include "core/scene/intrinsics.h"
#include "core/trace/traced_hits.h"
#include "formats/gltf/gltf_reader.h"
#include "support/hits_oracle.h"
#include "support/test_support.h"

namespace peeler::test {
namespace {

/// The limit of an error, in ray spacings. Neighbouring rays are 65,536 grid steps apart. Snapping
/// moves corners by up to half a step along each axis; the oracle, in double precision, has much
/// smaller errors.
constexpr double kTwoSteps = 2.0 / 65536;

void expectAgreement(const std::string& name, const Scene& scene, int directions, int resolution) {
    const Scene opaque = withoutAlpha(scene);
    const PosedScene posed(opaque);
    HitRasterizer source(posed);
    const HitsOracle oracle(posed);
    HitAgreement agreement;
    for (const View& view : oracle.views(directions, resolution)) {
        agreement.add(oracle.compare(source, view));
        EXPECT_EQ(source.gridBits(), 16);
    }
    agreement.print(name);
    peeler::TracedHits traced(posed, &source);
    HitAgreement lenses;
    for (const View& view : oracle.lensViews(resolution / 2))
        lenses.add(oracle.compare(traced, view));
    lenses.print(name + " through lenses");
    EXPECT_GT(lenses.hits, lenses.rays / 10);
    EXPECT_LE(static_cast<double>(lenses.differing), 1e-6 * static_cast<double>(lenses.rays));
    EXPECT_LE(lenses.farthest, 1e-6);
    EXPECT_LE(lenses.largest_error, 1e-7);
    EXPECT_GT(agreement.hits, agreement.rays / 10);
    EXPECT_LE(static_cast<double>(agreement.differing), 5e-6 * static_cast<double>(agreement.rays));
    EXPECT_LE(agreement.farthest, kTwoSteps);
    EXPECT_LE(agreement.largest_error, 1e-7);
}

// These models have many parts, much occlusion, a skin, or compressed geometry.
const char* const kModelsForHits[] = {
    "2CylinderEngine/glTF/2CylinderEngine.gltf",
    "CesiumMan/glTF-Binary/CesiumMan.glb",
    "DamagedHelmet/glTF-Binary/DamagedHelmet.glb",
    "GearboxAssy/glTF-Draco/GearboxAssy.gltf",
    "StainedGlassLamp/glTF-JPG-PNG/StainedGlassLamp.gltf",
};

class HitsOracleOfModels : public testing::TestWithParam<const char*> {};
INSTANTIATE_TEST_SUITE_P(Models, HitsOracleOfModels, testing::ValuesIn(kModelsForHits),
                         [](const auto& row) {
                             const std::string path = row.param;
                             return path.substr(0, path.find('/'));
                         });

TEST_P(HitsOracleOfModels, FindsTheSameHitsInDoublePrecision) {
    PEELER_REQUIRE_ASSETS(assets);
    const Scene scene = readGltf(assets / "gltf-sample-assets" / GetParam());
    expectAgreement(GetParam(), scene, exhaustive() ? 6 : 2, exhaustive() ? 1024 : 512);
}

TEST(HitsOracle, FindsTheSameHitsInTriangleSoups) {
    for (const unsigned seed : {1U, 2U, 3U})
        expectAgreement("soup of seed " + std::to_string(seed), randomTriangles(seed, 1000), 4,
                        exhaustive() ? 1024 : 512);
}

TEST(HitsOracle, CoincidentModelsHaveTwiceTheHits) {
    PEELER_REQUIRE_ASSETS(assets);
    for (const char* model :
         {"DamagedHelmet/glTF-Binary/DamagedHelmet.glb", "CesiumMan/glTF-Binary/CesiumMan.glb"}) {
        const Scene once = readGltf(assets / "gltf-sample-assets" / model), twice = doubled(once);
        const PosedScene shown(once), both(twice);
        HitRasterizer one(shown), two(both);
        const HitsOracle oracle(shown);
        for (const View& view : oracle.views(exhaustive() ? 16 : 3, exhaustive() ? 1024 : 400)) {
            const LayeredImage a = trace(one, view).image, b = trace(two, view).image;
            EXPECT_GT(a.fragments(), a.window.pixels() / 10);
            expectTwiceTheHits(a, b);
        }
    }
}

/// Ray counts for closed surfaces; `odd` counts rays with an odd number of hits.
struct Parity {
    std::size_t solids = 0, rays = 0, hits = 0, odd = 0;
};

/// Returns a picture of all directions, equirectangular, from a point outside the box.
View allAround(const Bounds& box, const glm::dvec3& direction, int resolution) {
    const glm::dvec3 middle = 0.5 * (box.min + box.max);
    View view;
    view.camera_to_world = *lookAlong(middle - 0.7 * glm::length(box.max - box.min) * direction,
                                      direction, {0.1, 1, 0.2});
    view.width = 2 * resolution;
    view.height = resolution;
    view.crop = {0, 0, view.width, view.height};
    setLens(view, {{"equirectangular"}});
    return view;
}

Parity parityOf(const PosedScene& posed, const Solids& solids, int directions, int resolution) {
    Parity parity;
    for (const Solid& solid : solids.all())
        parity.solids += solid.closed() ? 1 : 0;
    if (parity.solids == 0) return parity;
    HitRasterizer rasterizer(posed);
    peeler::TracedHits source(posed, &rasterizer);
    const Bounds box = posed.bounds().value();
    std::vector<View> views;
    for (const glm::dvec3& direction : sphereDirections(directions)) {
        views.push_back(parallelBundle("b", box, box, direction, {resolution}).view);
        if (exhaustive() || views.size() == 1)
            views.push_back(allAround(box, direction, resolution));
    }
    SolidSpans spans;
    for (const View& view : views) {
        const LayeredImage image = trace(source, view).image;
        const auto keys = image.extra.front().as<const std::uint32_t>();
        for (std::size_t p = 0; p < image.window.pixels(); ++p) {
            const std::size_t first = image.offsets[p], count = image.count(p);
            if (count == 0) continue;
            spans.find(std::span(image.z).subspan(first, count), keys.subspan(first, count),
                       solids);
            for (const auto& [solid, hits] : spans.hits()) {
                if (!solids.all()[solid].closed()) continue;
                ++parity.rays;
                parity.hits += hits.hits;
                parity.odd += hits.odd() ? 1 : 0;
            }
        }
    }
    return parity;
}

TEST(ClosedModelsOnTheCpu, EveryRayLeavesWhatItEnters) {
    PEELER_REQUIRE_ASSETS(assets);
    Parity all;
    std::size_t models = 0;
    GltfOptions options;
    options.ignored_extensions = undecodedImageExtensions();  // colours do not affect rays
    for (const std::filesystem::path& file : modelFiles(assets / "gltf-sample-assets")) {
        const std::string name = file.lexically_relative(assets).string();
        // The short run skips variants of models that also exist as plain glTF.
        if (!exhaustive() && file.parent_path().filename() != "glTF" &&
            std::filesystem::exists(file.parent_path().parent_path() / "glTF"))
            continue;
        const Scene scene = withoutAlpha(readGltf(file, options));
        const PosedScene posed(scene);
        const Solids solids(posed);
        const Parity parity =
            parityOf(posed, solids, exhaustive() ? 64 : 5, exhaustive() ? 256 : 128);
        if (parity.solids == 0) continue;
        EXPECT_EQ(parity.odd, 0U) << name;
        EXPECT_GT(parity.rays, 0U) << name;
        ++models;
        all.solids += parity.solids;
        all.rays += parity.rays;
        all.hits += parity.hits;
        all.odd += parity.odd;
    }
    std::printf("%zu models with %zu closed surfaces: of %zu rays (%zu hits) %zu odd\n", models,
                all.solids, all.rays, all.hits, all.odd);
    EXPECT_GE(models, 20U);
    EXPECT_EQ(all.odd, 0U);
}

}  // namespace
}  // namespace peeler::test
