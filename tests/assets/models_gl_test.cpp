// SPDX-License-Identifier: Apache-2.0
// Every method on every static real model, and the example scenes: the same layers, bit for bit.
#include <gtest/gtest.h>

#include <cstdio>

#include "assets/models.h"
#include "cmd/camera_options.h"
#include "core/peel/method.h"
#include "formats/gltf_reader.h"
#include "support/capture.h"
#include "support/test_support.h"

namespace peeler::test {
namespace {

namespace fs = std::filesystem;

/// Captures the model with every method and compares; returns the fragments of the picture.
std::size_t compareMethods(const fs::path& path, const CaptureSettings& base) {
    SCOPED_TRACE(path.filename().string());
    const Scene scene = readGltf(path);
    cmd::CameraOptions camera;
    camera.size = {200, 150};
    const int index = scene.default_scene;
    const View view = cmd::makeView(scene, contents(scene, index), camera);
    const auto reference = capture(scene, view, base);
    EXPECT_EQ(reference.plan.complete(), base.max_layers == 0);
    for (const auto& method : peelMethods()) {
        if (!method.exact()) continue;
        if (method.name == base.method) continue;
        CaptureSettings settings = base;
        settings.method = method.name;
        const auto other = capture(scene, view, settings);
        EXPECT_EQ(difference(reference.image, other.image), "") << method.name;
    }
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
    EXPECT_GT(fragments, 300000U);
}

TEST(Models, EveryMethodGivesTheSameLayersOfTheExampleScenes) {
    std::size_t scenes = 0;
    for (const auto& entry : fs::directory_iterator(sourceDir() / "examples" / "scenes")) {
        if (entry.path().extension() != ".glb") continue;
        ++scenes;
        EXPECT_GT(compareMethods(entry.path(), {}), 1000U);
        EXPECT_GT(compareMethods(entry.path(), {.surfaces = Surfaces::kVisible}), 1000U);
        EXPECT_GT(compareMethods(entry.path(), {.color_type = PixelType::kFloat, .max_layers = 3}),
                  0U);
    }
    EXPECT_GE(scenes, 5U);
}

}  // namespace
}  // namespace peeler::test
