// SPDX-License-Identifier: Apache-2.0
// Tests that all methods give the same layers, bit for bit, for all static real models and the
// example scenes.
#include <gtest/gtest.h>

#include <cmath>
#include <cstdio>
#include <cstring>
#include <random>
#include <vector>

#include <peeler/composite.h>
#include "assets/model_files.h"
#include "assets/models.h"
#include "cmd/options/camera_options.h"
#include "core/capture/method.h"
#include "formats/gltf/gltf_reader.h"
#include "support/capture.h"
#include "support/test_support.h"

namespace peeler::test {
namespace {

namespace fs = std::filesystem;

/// Composites the model on the fly with each of these methods, and compares each result with the
/// composite of the layers.
void compareComposites(GlRenderer& renderer, const View& view, const CaptureSettings& base,
                       const std::vector<MethodInfo>& methods, const LayeredImage& layers) {
    CompositeImage wanted, shown;
    compositeOver(layers, {}, wanted);
    for (const MethodInfo& method : methods) {
        CaptureSettings settings = base;
        settings.method = method.name;
        settings.composite = true;
        compositeOver(capture(renderer, view, settings).image, {}, shown);
        float worst = 0;
        for (std::size_t p = 0; p < wanted.rgba.size(); ++p) {
            ASSERT_EQ(wanted.z[p], shown.z[p]) << method.name;
            for (std::size_t c = 0; c < 4; ++c) {
                // The rounding error of half floats is relative, so the tolerance grows with the
                // brightness.
                const float scale = std::max(1.0F, std::abs(wanted.rgba[p][c]));
                worst = std::max(worst, std::abs(wanted.rgba[p][c] - shown.rgba[p][c]) / scale);
            }
        }
        EXPECT_LT(worst, 1e-5F) << method.name;
        // Methods without GPU compositing also composite on the CPU, so the bits must be equal.
        if (method.composite || settings.max_layers != 0) continue;
        EXPECT_EQ(std::memcmp(wanted.rgba.data(), shown.rgba.data(),
                              wanted.rgba.size() * sizeof wanted.rgba[0]),
                  0)
            << method.name;
    }
}

/// Returns the exact methods; in the short run, every third of them from a random start, with a
/// fixed seed.
std::vector<MethodInfo> exactMethods() {
    static std::minstd_rand random;
    std::vector<MethodInfo> methods;
    std::size_t number = random() % 3;
    for (const MethodInfo& method : peelMethods()) {
        if (method.exact() && (exhaustive() || number++ % 3 == 0)) methods.push_back(method);
    }
    return methods;
}

/// Captures the model by exact methods and compares the results. Returns the number of fragments.
std::size_t compareMethods(const fs::path& path, const CaptureSettings& base) {
    SCOPED_TRACE(path.filename().string());
    const Scene scene = readGltf(path);
    cmd::CameraOptions camera;
    camera.size = exhaustive() ? Size{200, 150} : Size{120, 90};
    const int index = scene.default_scene;
    const PosedScene shown(scene, index);
    const View view = cmd::makeView(shown, SceneExtent(shown), camera);
    GlRenderer renderer(sharedContext(), shown);
    const auto reference = capture(renderer, view, base);
    EXPECT_TRUE(reference.plan.complete() || base.max_layers != 0);
    const std::vector<MethodInfo> methods = exactMethods();
    for (const MethodInfo& method : methods) {
        if (method.name == base.method) continue;
        CaptureSettings settings = base;
        settings.method = method.name;
        const auto other = capture(renderer, view, settings);
        EXPECT_EQ(difference(reference.image, other.image), "") << method.name;
    }
    compareComposites(renderer, view, base, methods, reference.image);
    return reference.image.fragments();
}

TEST(Models, EveryMethodGivesTheSameLayers) {
    PEELER_REQUIRE_ASSETS(assets);
    const auto models = staticModels(assets);
    ASSERT_GT(models.size(), 40U);
    std::size_t fragments = 0;
    for (const auto& model : models)
        fragments += compareMethods(model, {});
    std::printf("%zu models, %zu fragments\n", models.size(), fragments);
    EXPECT_GT(fragments, exhaustive() ? 300000U : 100000U);
}

TEST(Models, EveryMethodGivesTheSameLayersOfTheExampleScenes) {
    std::size_t scenes = 0;
    for (const auto& path : modelFiles(sourceDir() / "examples" / "scenes")) {
        ++scenes;
        EXPECT_GT(compareMethods(path, {}), 1000U);
        const CaptureSettings visible{.surfaces = Surfaces::kVisible};
        const CaptureSettings nearest{.color_type = PixelType::kFloat, .max_layers = 3};
        for (const CaptureSettings& more : {visible, nearest})
            if (exhaustive() || (scenes % 2 == 0) == (more.max_layers == 0))
                compareMethods(path, more);
    }
    EXPECT_GE(scenes, 5U);
}

}  // namespace
}  // namespace peeler::test
