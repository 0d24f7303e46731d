// SPDX-License-Identifier: Apache-2.0
// Compares layers of compressed and quantised models with those of the plain model, with a
// tolerance for quantisation.
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <cstdio>

#include "cmd/options/camera_options.h"
#include "formats/gltf/gltf_reader.h"
#include "support/capture.h"
#include "support/test_support.h"

namespace peeler::test {
namespace {

namespace fs = std::filesystem;

struct Pair {
    const char *name, *plain, *variant;
    int bits;  ///< bits per coordinate; their range is the model's longest side
};

const Pair kPairs[] = {
    {"DuckDraco", "Duck/glTF/Duck.gltf", "Duck/glTF-Draco/Duck.gltf", 11},
    {"DuckQuantized", "Duck/glTF/Duck.gltf", "Duck/glTF-Quantized/Duck.gltf", 14},
    {"MilkTruckDraco", "CesiumMilkTruck/glTF/CesiumMilkTruck.gltf",
     "CesiumMilkTruck/glTF-Draco/CesiumMilkTruck.gltf", 11},
    {"BoxTexturedMeshopt", "BoxTextured/glTF/BoxTextured.gltf",
     "BoxTexturedMeshopt/BoxTextured_meshopt.glb", 14},
};

class CompressedLayers : public testing::TestWithParam<Pair> {};

LayeredImage layersOf(const Scene& scene, const View& view) {
    const PosedScene shown(scene);
    GlRenderer renderer(sharedContext(), shown);
    const Captured captured = capture(renderer, view, {.color_type = PixelType::kFloat});
    EXPECT_TRUE(captured.plan.complete());
    return captured.image;
}

TEST_P(CompressedLayers, AreThoseOfThePlainModel) {
    PEELER_REQUIRE_ASSETS(assets);
    const fs::path folder = assets / "gltf-sample-assets";
    const Scene plain = readGltf(folder / GetParam().plain);
    const Scene variant = readGltf(folder / GetParam().variant);
    cmd::CameraOptions camera;
    camera.size = {320, 240};
    const PosedScene shown(plain);
    // Both models get the same camera. The default framing would depend on the bounds, which
    // quantisation changes.
    const View view = cmd::makeView(shown, SceneExtent(shown), camera);
    const LayeredImage a = layersOf(plain, view), b = layersOf(variant, view);
    const Bounds box = *shown.bounds();
    const glm::dvec3 size = box.max - box.min;
    const double step = std::max({size.x, size.y, size.z}) * std::ldexp(1.0, -GetParam().bits);

    // Quantisation moves edges by less than a pixel, so a few pixels gain or lose a layer. On steep
    // surfaces, Z changes by more than a step.
    std::size_t covered = 0, other_count = 0, moved = 0, fragments = 0, recolored = 0;
    for (std::size_t p = 0; p + 1 < a.offsets.size(); ++p) {
        const std::size_t count = a.offsets[p + 1] - a.offsets[p];
        if (count == 0 && b.offsets[p + 1] == b.offsets[p]) continue;
        ++covered;
        if (b.offsets[p + 1] - b.offsets[p] != count) {
            ++other_count;
            continue;
        }
        for (std::size_t k = 0; k < count; ++k) {
            ++fragments;
            const std::size_t i = a.offsets[p] + k, j = b.offsets[p] + k;
            moved += std::abs(static_cast<double>(a.z[i]) - static_cast<double>(b.z[j])) > 4 * step;
            const glm::vec4 d = glm::abs(color(a, i) - color(b, j));
            recolored += std::max({d.r, d.g, d.b}) > 0.1F;
        }
    }
    std::printf(
        "%s: %zu pixels, %zu with another number of layers; of %zu fragments %zu moved, %zu "
        "of another colour\n",
        GetParam().name, covered, other_count, fragments, moved, recolored);
    EXPECT_GT(covered, 4000U);
    const auto share = [](std::size_t part, std::size_t whole) {
        return static_cast<double>(part) / static_cast<double>(whole);
    };
    EXPECT_LT(share(other_count, covered), 0.02);
    EXPECT_LT(share(moved, fragments), 0.02);
    EXPECT_LT(share(recolored, fragments), 0.02);
}

INSTANTIATE_TEST_SUITE_P(Pairs, CompressedLayers, testing::ValuesIn(kPairs),
                         [](const auto& test) { return std::string(test.param.name); });

}  // namespace
}  // namespace peeler::test
