// SPDX-License-Identifier: Apache-2.0
// Runs the command on all static real models: captures are complete, and both backends write the
// same bytes.
#include <gtest/gtest.h>

#include <algorithm>
#include <cstdio>
#include <iterator>
#include <nlohmann/json.hpp>

#include "assets/model_files.h"
#include "assets/models.h"
#include "formats/image/flat_image.h"
#include "support/test_support.h"

namespace peeler::test {
namespace {

namespace fs = std::filesystem;

TEST(Models, RenderCompletelyAndAlikeOnBothBackends) {
    PEELER_REQUIRE_ASSETS(assets);
    const ScratchDir scratch;
    auto models = staticModels(assets);
    ASSERT_GT(models.size(), 40U);
    std::ranges::copy(modelFiles(sourceDir() / "examples" / "scenes"), std::back_inserter(models));
    for (const auto& model : models) {
        SCOPED_TRACE(model.string());
        std::string bytes[2];
        const char* const backends[] = {"egl", "osmesa"};
        for (int i = 0; i < 2; ++i) {
            const fs::path out = scratch / (std::string(backends[i]) + ".exr");
            const auto run = runPeeler({"render", model, "-o", out, "--size", "320x240",
                                        "--backend", backends[i], "--json", "--quiet"});
            ASSERT_EQ(run.exit_code, 0) << run.err;
            const auto json = nlohmann::json::parse(run.out);
            EXPECT_EQ(json.at("complete"), true);
            EXPECT_EQ(json.at("fragmentsCounted"), json.at("fragmentsStored"));
            EXPECT_GT(json.at("layers"), 0);
            bytes[i] = bytesOf(out);
        }
        EXPECT_FALSE(bytes[0].empty());
        // Without a GPU both backends are llvmpipe, so even the recorded renderer is the same.
        EXPECT_TRUE(bytes[0] == bytes[1]) << "the files of the two backends differ";
    }
    std::printf("%zu models on 2 backends\n", models.size());
}

/// The first steps of a user who wants pictures of ten models and has not read the manual.
TEST(Models, TenGiveTheirFirstPictures) {
    PEELER_REQUIRE_ASSETS(assets);
    const ScratchDir scratch;
    const fs::path samples = assets / "gltf-sample-assets";
    std::vector<std::string> line{"render"};
    for (const char* model :
         {"2CylinderEngine/glTF/2CylinderEngine.gltf", "CesiumMan/glTF-Binary/CesiumMan.glb",
          "CesiumMilkTruck/glTF-Draco/CesiumMilkTruck.gltf",
          "DamagedHelmet/glTF-Binary/DamagedHelmet.glb", "Duck/glTF-Binary/Duck.glb",
          "Fox/glTF/Fox.gltf", "GearboxAssy/glTF-Draco/GearboxAssy.gltf",
          "GlassVaseFlowers/glTF/GlassVaseFlowers.gltf",
          "LightsPunctualLamp/glTF/LightsPunctualLamp.gltf",
          "StainedGlassLamp/glTF-JPG-PNG/StainedGlassLamp.gltf"})
        line.push_back(samples / model);
    line.insert(line.end(), {"-o", scratch / "pictures/{stem}.png", "--size", "320x180", "--json"});
    const Outcome run = runPeeler(line);
    ASSERT_EQ(run.exit_code, 0) << run.err;
    const auto json = nlohmann::json::parse(run.out);
    ASSERT_EQ(json.at("scenes").size(), 10U);
    // The notice about software rendering must appear only once.
    const std::string notice = "renders in software";
    const auto at = run.err.find(notice);
    EXPECT_EQ(run.err.find(notice, at + 1), std::string::npos) << run.err;
    for (const auto& scene : json.at("scenes")) {
        const std::string output = scene.at("output");
        SCOPED_TRACE(output);
        const CompositeImage picture = readFlatImage(output).image;
        ASSERT_EQ(picture.rgba.size(), std::size_t{320} * 180);
        std::size_t covered = 0, clipped = 0, dark = 0;
        for (const auto& [r, g, b, a] : picture.rgba) {
            if (a < 0.5F) continue;
            ++covered;
            clipped += r >= 1 && g >= 1 && b >= 1 ? 1 : 0;
            dark += r + g + b < 0.003F ? 1 : 0;
        }
        EXPECT_GT(covered, picture.rgba.size() / 50);
        EXPECT_LT(covered, picture.rgba.size() * 9 / 10);
        EXPECT_LT(clipped, covered / 10);
        EXPECT_LT(dark, covered / 4);
    }
}

}  // namespace
}  // namespace peeler::test
