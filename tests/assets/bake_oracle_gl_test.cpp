// SPDX-License-Identifier: Apache-2.0
// Compares occlusion baked for real models with an independent oracle: Embree rays.
#include <gtest/gtest.h>

#include <cstdio>

#include "core/bake/bake.h"
#include "core/bake/receivers.h"
#include "formats/gltf/gltf_reader.h"
#include "support/capture.h"
#include "support/occlusion_oracle.h"
#include "support/test_support.h"

namespace peeler::test {
namespace {

struct Model {
    const char* path;
    double bound;  // limit of the error with 256 directions: 1.5 times the measured error
};

// The second model's bound is larger: its thin shells need denser rays
// (tests/benchmarks/bake_ao.cpp).
constexpr Model kModelsToBake[] = {
    {"Duck/glTF-Quantized/Duck.gltf", 0.015},
    {"DamagedHelmet/glTF-Binary/DamagedHelmet.glb", 0.043},
};

class BakeOracle : public testing::TestWithParam<Model> {};
INSTANTIATE_TEST_SUITE_P(Models, BakeOracle, testing::ValuesIn(kModelsToBake), [](const auto& row) {
    const std::string path = row.param.path;
    std::string name = path.substr(0, path.find('/'));
    return name;
});

TEST_P(BakeOracle, VerticesAreAsOccludedAsEmbreeHasIt) {
    PEELER_REQUIRE_ASSETS(assets);
    const Scene scene = readGltf(assets / "gltf-sample-assets" / GetParam().path);
    const PosedScene shown(scene);
    const VertexReceivers vertices(shown);
    const Receivers& receivers = vertices.receivers();
    const Bounds box = *shown.bounds();
    const TriangleSoup soup = soupOf(scene);
    const OcclusionOracle oracle(soup, static_cast<float>(1e-4 * glm::length(box.max - box.min)));
    const auto reference = oracle.reference(receivers, 1024);
    GlRenderer renderer(sharedContext(), shown);
    double before = 1;
    for (const int directions : {16, 64, 256}) {
        BakeSettings settings;
        settings.directions = directions;
        CaptureSettings capture;
        capture.faces = Faces::kBoth;
        const auto values = bake(renderer, receivers, settings, capture, {}, {});
        const double error = rootMeanSquare(receivers, values, reference);
        std::printf("%d directions: RMSE %.4f\n", directions, error);
        EXPECT_LT(error, before);
        before = error;
    }
    EXPECT_LT(before, GetParam().bound);
}

}  // namespace
}  // namespace peeler::test
