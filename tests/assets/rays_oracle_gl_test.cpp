// SPDX-License-Identifier: Apache-2.0
// Compares GL's hits of bundles with an independent oracle (hits_oracle_test.cpp tests the CPU's
// hits).
#include <gtest/gtest.h>

#include <cmath>

#include "formats/gltf/gltf_reader.h"
#include "support/capture.h"
#include "support/hits_oracle.h"
#include "support/test_support.h"

namespace peeler::test {
namespace {

void expectAgreementOfGl(const std::string& name, const Scene& scene, int directions,
                         int resolution) {
    const Scene opaque = withoutAlpha(scene);
    const PosedScene posed(opaque);
    GlRenderer renderer(sharedContext(), posed);
    const HitsOracle oracle(posed);
    HitAgreement agreement;
    for (const View& view : oracle.views(directions, resolution))
        agreement.add(oracle.compare(renderer, view));
    agreement.print(name);
    EXPECT_GT(agreement.hits, agreement.rays / 10);
    EXPECT_LE(static_cast<double>(agreement.differing),
              0.001 * static_cast<double>(agreement.rays));
    // Vertices are snapped to a grid of 1/256 along each axis.
    EXPECT_LE(agreement.farthest, std::sqrt(2.0) / 256);
    EXPECT_LE(agreement.largest_error, 1e-6);
}

const char* const kModelsForRays[] = {
    "2CylinderEngine/glTF/2CylinderEngine.gltf",
    "DamagedHelmet/glTF-Binary/DamagedHelmet.glb",
    "Duck/glTF-Quantized/Duck.gltf",
    "CesiumMilkTruck/glTF/CesiumMilkTruck.gltf",
    "NegativeScaleTest/glTF/NegativeScaleTest.gltf",
};

class RaysOracle : public testing::TestWithParam<const char*> {};
INSTANTIATE_TEST_SUITE_P(Models, RaysOracle, testing::ValuesIn(kModelsForRays),
                         [](const auto& row) {
                             const std::string path = row.param;
                             std::string name = path.substr(0, path.find('/'));
                             return name;
                         });

TEST_P(RaysOracle, FindsTheSameHits) {
    PEELER_REQUIRE_ASSETS(assets);
    expectAgreementOfGl(GetParam(), readGltf(assets / "gltf-sample-assets" / GetParam()), 3, 640);
}

TEST(RaysOracle, FindsTheSameHitsInTriangleSoups) {
    for (const unsigned seed : {1U, 2U, 3U})
        expectAgreementOfGl("soup of seed " + std::to_string(seed), randomTriangles(seed, 1000), 4,
                            400);
}

TEST(RaysOracle, CoincidentMeshesHaveTwiceTheHits) {
    PEELER_REQUIRE_ASSETS(assets);
    const Scene once = readGltf(assets / "gltf-sample-assets" / kModelsForRays[1]);
    const Scene twice = doubled(once);
    const PosedScene shown(once);
    const Bounds box = *shown.bounds();
    GlRenderer one(sharedContext(), shown), two(sharedContext(), PosedScene(twice));
    for (const glm::dvec3& direction : sphereDirections(3)) {
        const Bundle bundle = parallelBundle("b", box, box, direction, {});
        const LayeredImage a = trace(one, bundle.view).image;
        const LayeredImage b = trace(two, bundle.view).image;
        ASSERT_GT(a.fragments(), 100'000U);
        expectTwiceTheHits(a, b);
    }
}

}  // namespace
}  // namespace peeler::test
