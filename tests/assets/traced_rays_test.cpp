// SPDX-License-Identifier: Apache-2.0
// Traces rays at real models with closed surfaces, most of them aimed at corners and edges: every
// ray must leave each solid that it enters.
#include <gtest/gtest.h>

#include <cstdio>
#include <filesystem>

#include "assets/model_files.h"
#include "core/trace/ray_tracer.h"
#include "formats/gltf/gltf_reader.h"
#include "support/aimed_rays.h"
#include "support/hits_oracle.h"
#include "support/test_support.h"

namespace peeler::test {
namespace {

TEST(TracedModels, EveryRayLeavesWhatItEnters) {
    PEELER_REQUIRE_ASSETS(assets);
    AimedRays::Odd all;
    std::size_t models = 0, rays = 0;
    GltfOptions options;
    options.ignored_extensions = undecodedImageExtensions();  // colours do not affect rays
    for (const std::filesystem::path& file : modelFiles(assets / "gltf-sample-assets")) {
        const std::string name = file.lexically_relative(assets).string();
        // Variants of models that also exist as plain glTF have the same surfaces.
        if (file.parent_path().filename() != "glTF" &&
            std::filesystem::exists(file.parent_path().parent_path() / "glTF"))
            continue;
        const Scene scene = withoutAlpha(readGltf(file, options));
        const PosedScene posed(scene);
        if (!posed.bounds()) continue;
        const AimedRays aimed(posed);
        const auto& solids = aimed.solids().all();
        if (std::none_of(solids.begin(), solids.end(), [](const auto& s) { return s.closed(); }))
            continue;
        const std::size_t count = exhaustive() ? 500'000 : 5'000;
        const RayTracer tracer(posed);
        const AimedRays::Odd odd = aimed.odd(tracer, count, 1);
        EXPECT_EQ(odd.rays, 0U) << name;
        ++models;
        rays += count;
        all.aimed += odd.aimed;
        all.hits += odd.hits;
        all.rays += odd.rays;
    }
    std::printf("%zu models: of %zu rays (%zu aimed at corners and edges, %zu hits) %zu odd\n",
                models, rays, static_cast<std::size_t>(all.aimed),
                static_cast<std::size_t>(all.hits), static_cast<std::size_t>(all.rays));
    EXPECT_GE(models, 20U);
    EXPECT_EQ(all.rays, 0U);
}

TEST(TracedModels, CoincidentModelsHaveTwiceTheHits) {
    PEELER_REQUIRE_ASSETS(assets);
    for (const char* model :
         {"DamagedHelmet/glTF-Binary/DamagedHelmet.glb", "CesiumMan/glTF-Binary/CesiumMan.glb"}) {
        const Scene once = withoutAlpha(readGltf(assets / "gltf-sample-assets" / model));
        const Scene twice = doubled(once);
        const RayTracer one{PosedScene(once)}, two{PosedScene(twice)};
        const auto rays = AimedRays(one.posed()).rays(exhaustive() ? 1'000'000 : 20'000, 2);
        RayHits a, b;
        one.trace(rays, {Faces::kBoth}, a);
        two.trace(rays, {Faces::kBoth}, b);
        EXPECT_GT(a.t.size(), rays.size() / 2);
        ASSERT_EQ(b.t.size(), 2 * a.t.size());
        for (std::size_t i = 0; i < rays.size(); ++i)
            ASSERT_EQ(b.offsets[i], 2 * a.offsets[i]);
        for (std::size_t i = 0; i < b.t.size(); ++i)
            ASSERT_EQ(b.t[i], a.t[i / 2]);
    }
}

}  // namespace
}  // namespace peeler::test
