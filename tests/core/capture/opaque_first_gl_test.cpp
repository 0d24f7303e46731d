// SPDX-License-Identifier: Apache-2.0
// Tests that composites without the fragments behind opaque surfaces equal, bit for bit, composites
// of all layers.
#include <gtest/gtest.h>

#include <cstring>
#include <string>

#include <peeler/composite.h>
#include "assets/model_files.h"
#include "cmd/options/camera_options.h"
#include "core/base/process_memory.h"
#include "core/capture/method.h"
#include "core/fragments/supersampling.h"
#include "formats/gltf/gltf_reader.h"
#include "support/capture.h"
#include "support/flat.h"
#include "support/hard_scenes.h"
#include "support/test_support.h"

namespace peeler::test {
namespace {

/// Returns a description of the first pixel whose colour or Z is not equal bit for bit; "" if all
/// pixels are equal.
std::string pixelThatDiffers(const CompositeImage& a, const CompositeImage& b) {
    if (a.window != b.window) return "another window";
    for (std::size_t p = 0; p < a.rgba.size(); ++p) {
        if (std::memcmp(&a.rgba[p], &b.rgba[p], sizeof a.rgba[p]) == 0 &&
            std::memcmp(&a.z[p], &b.z[p], sizeof a.z[p]) == 0)
            continue;
        return "pixel " + std::to_string(p) + ": red " + std::to_string(a.rgba[p][0]) + ", " +
               std::to_string(b.rgba[p][0]) + "; Z " + std::to_string(a.z[p]) + ", " +
               std::to_string(b.z[p]);
    }
    return a.opacity == b.opacity ? "" : "opacity";
}

/// Composites all layers on the CPU, including those behind opaque surfaces.
CompositeImage compositeOfLayers(GlRenderer& renderer, const View& view, CaptureSettings settings) {
    const int samples = settings.samples;
    settings.samples = 1;
    settings.composite = false;
    CompositeImage mean;
    const auto positions = samplePositions(samples);
    for (int i = 0; i < samples; ++i) {
        View seen = view;
        if (samples > 1) seen.sample = positions[static_cast<std::size_t>(i)];
        const CompositeImage sample = flat(capture(renderer, seen, settings).image);
        if (samples == 1) return sample;
        if (i == 0) beginMean(sample.window, mean, sample.tinted());
        addToMean(sample, samples, mean);
    }
    return mean;
}

/// Compares an opaque-first composite with the composite of all layers, and the statistics of the
/// capture with those of the visible fragments.
void expectTheSame(const Scene& scene, const View& view, CaptureSettings settings,
                   const std::string& what) {
    const PosedScene shown(scene, 0);
    GlRenderer renderer(sharedContext(), shown);
    const CompositeImage wanted = compositeOfLayers(renderer, view, settings);
    settings.composite = true;
    const auto found = capture(renderer, view, settings);
    EXPECT_EQ(pixelThatDiffers(wanted, flat(found.image)), "") << what;
    EXPECT_TRUE(found.plan.complete()) << what;
    if (settings.samples > 1) return;
    settings.composite = false;
    settings.surfaces = Surfaces::kVisible;
    const Plan visible = renderer.plan(view, settings);
    EXPECT_EQ(found.plan.fragments_counted, visible.fragments_counted) << what;
    ASSERT_EQ(found.plan.layers.size(), visible.layers.size()) << what;
    for (std::size_t i = 0; i < visible.layers.size(); ++i) {
        EXPECT_EQ(found.plan.layers[i].pixels, visible.layers[i].pixels) << what;
        EXPECT_EQ(found.plan.layers[i].data_window, visible.layers[i].data_window) << what;
    }
}

/// Makes the materials opaque, masked and blended in turn.
Scene mixed(Scene scene, std::size_t first) {
    for (std::size_t i = first; i < scene.materials.size(); i += 3) {
        scene.materials[i].alpha_mode = AlphaMode::kOpaque;
        if (i + 1 < scene.materials.size())
            // Half of the masked materials fail the cutoff, so their surfaces vanish.
            scene.materials[i + 1].alpha_mode = AlphaMode::kMask;
    }
    return scene;
}

Scene allOpaque(Scene scene) {
    for (Material& material : scene.materials)
        material.alpha_mode = AlphaMode::kOpaque;
    return scene;
}

std::vector<HardScene> scenesWithOpaqueSurfaces() {
    std::vector<HardScene> scenes;
    for (const auto& [name, scene] : hardScenes()) {
        scenes.push_back({name, mixed(scene, 0)});
        scenes.push_back({name, mixed(scene, 1)});
        scenes.push_back({name, allOpaque(scene)});
    }
    return scenes;
}

TEST(OpaqueFirst, EqualsTheCompositeOfAllLayers) {
    const View view = exhaustive() ? testView(160, 120) : testView(80, 60);
    for (const auto& [name, scene] : scenesWithOpaqueSurfaces()) {
        for (const int samples : {1, 4}) {
            for (const PixelType precision : {PixelType::kHalf, PixelType::kFloat}) {
                CaptureSettings settings;
                settings.samples = samples;
                settings.color_type = precision;
                expectTheSame(scene, view, settings, name);
            }
        }
    }
}

// Blended materials transmit half of the light, tinted by the base colour.
TEST(OpaqueFirst, FiltersOpaqueSurfacesThroughColouredGlass) {
    for (const auto& [name, plain] : hardScenes()) {
        Scene scene = mixed(plain, 1);
        for (Material& material : scene.materials) {
            if (material.alpha_mode != AlphaMode::kBlend) continue;
            material.transmission.factor = 0.5F;
            material.base_color = {0.75F, 0.5F, 0.25F, 0.75F};
        }
        for (const int samples : {1, 4}) {
            for (const PixelType precision : {PixelType::kHalf, PixelType::kFloat}) {
                CaptureSettings settings;
                settings.samples = samples;
                settings.color_type = precision;
                settings.tinted = true;
                expectTheSame(scene, testView(160, 120), settings, name);
            }
        }
    }
}

// Four surfaces in one plane, in all 256 combinations of blended, opaque, masked and fully cut out.
// The mesh of the first surface is drawn twice. Draw order decides which surface is in front. Each
// picture shows 16 combinations side by side.
TEST(OpaqueFirst, KeepsDrawOrderWhereSurfacesCoincide) {
    struct Kind {
        AlphaMode mode;
        float alpha;
    };
    constexpr Kind kKinds[] = {{AlphaMode::kBlend, 0.5F},
                               {AlphaMode::kOpaque, 1},
                               {AlphaMode::kMask, 1},
                               {AlphaMode::kMask, 0.25F}};
    for (int orders = 0; orders < 256; orders += 16) {
        SceneBuilder builder;
        for (int order = orders; order < orders + 16; ++order) {
            const float x = 0.6F * static_cast<float>(order % 4) - 1.2F;
            const float y = 0.45F * static_cast<float>(order / 4 % 4) - 0.9F;
            const int first = static_cast<int>(builder.scene().meshes.size());
            for (int i = 0, rest = order; i < 4; ++i, rest /= 4) {
                const Kind& kind = kKinds[rest % 4];
                const float shade = 0.2F * static_cast<float>(i + 1);
                const int material =
                    builder.material({shade, 1 - shade, 0.5F, kind.alpha}, kind.mode);
                builder.quad({x, y, -2}, {x + 0.5F, y, -2}, {x + 0.5F, y + 0.4F, -2},
                             {x, y + 0.4F, -2}, material);
                if (i == 2) builder.instance(first, glm::dmat4(1));
            }
        }
        expectTheSame(builder.scene(), testView(40, 30), {}, "orders " + std::to_string(orders));
    }
}

TEST(OpaqueFirst, HoldsForEveryWayToSeeAScene) {
    const Scene scene = mixed(hardScenes()[0].scene, 1);
    CaptureSettings settings;
    for (const Faces faces : {Faces::kFront, Faces::kBack, Faces::kBoth}) {
        settings.faces = faces;
        expectTheSame(scene, testView(160, 120), settings, "faces");
    }
    settings = {};
    settings.clip.half_spaces = {{glm::dvec3(0.3, 0.2, 0.9), -3.9}};
    expectTheSame(scene, testView(160, 120), settings, "a half-space");
    settings.clip = {};
    settings.clip.nodes = {3};
    expectTheSame(scene, testView(160, 120), settings, "a clip mesh");
    settings = {};
    settings.opaque_only = true;
    expectTheSame(scene, testView(160, 120), settings, "what is opaque alone");
    View view = testView(160, 120);
    view.projection.perspective = false;
    view.projection.half_width = 2;
    view.projection.half_height = 1.5;
    view.projection.far = 9;
    expectTheSame(scene, view, {}, "in parallel");
    view = testView(160, 120);
    view.crop = {13, 57, 151, 99};
    expectTheSame(scene, view, {}, "cropped");
}

TEST(OpaqueFirst, LeavesEmptyWhatIsBesideTheScene) {
    const Scene scene = mixed(hardScenes()[0].scene, 0);
    for (const bool tinted : {false, true}) {
        for (const int samples : {1, 4}) {
            CaptureSettings settings;
            settings.samples = samples;
            settings.tinted = tinted;
            for (const glm::dvec2 aside : {glm::dvec2(0), glm::dvec2(7, 4), glm::dvec2(-11, 0),
                                           glm::dvec2(0, 9), glm::dvec2(90)}) {
                View view = testView(240, 160);
                // The small scene is in the middle, in a corner, at two sides, or outside the
                // picture.
                view.camera_to_world[3] = {aside, 12, 1};
                expectTheSame(scene, view, settings, "beside the scene");
                view.crop = {30, 20, 100, 150};
                expectTheSame(scene, view, settings, "beside the scene, cropped");
            }
        }
    }
}

TEST(OpaqueFirst, DoesNotDependOnBandsTilesOrTheDriversExtensions) {
    const Scene scene = mixed(hardScenes()[0].scene, 0);
    View view = testView(4200, 150);
    view.projection.half_width = 0.5;  // the same frustum, stretched over two raster tiles
    view.crop = {3900, 10, 4200, 140};
    for (const int samples : {1, 4}) {
        CaptureSettings settings;
        settings.samples = samples;
        expectTheSame(scene, view, settings, "two raster tiles");
        settings.band_bytes = 1 << 19;
        expectTheSame(scene, view, settings, "bands");
        settings.composite = true;
        const auto extended = capture(scene, view, settings);
        EXPECT_GT(extended.bands.size(), 3U);
        inOwnThread([&] {
            const auto core = gl::createContext({.backend = testBackend(), .core_only = true});
            EXPECT_EQ(difference(extended.image, capture(scene, view, settings, *core).image), "");
        });
    }
}

// The first budget is too small to keep the plan's results. The second is too small even for the
// render targets of opaque surfaces.
TEST(OpaqueFirst, DoesNotDependOnTheBudget) {
    if (kShadowMemory) GTEST_SKIP() << "its memory is not the product's";
    SceneBuilder builder;
    for (int i = 0; i < 6; ++i) {
        const auto z = static_cast<float>(1 + (i * 5) % 7);
        const AlphaMode mode = i % 2 == 0 ? AlphaMode::kOpaque : AlphaMode::kBlend;
        builder.rectangle(0.2F * z, 0.3F * z, -z,
                          builder.material({0.1F * z, 1 - 0.1F * z, 0.5F, 0.4F}, mode));
    }
    const PosedScene shown(builder.scene(), 0);
    GlRenderer renderer(sharedContext(), shown);
    CaptureSettings settings;
    settings.composite = true;
    const View view = testView(2400, 1800);
    const auto whole = capture(renderer, view, settings);
    for (const std::uint64_t more : {480U, 250U}) {
        settings.memory = residentBytes() + (more << 20);
        const auto cut = capture(renderer, view, settings);
        EXPECT_EQ(difference(whole.image, cut.image), "") << more;
        EXPECT_EQ(whole.plan.fragments_counted, cut.plan.fragments_counted) << more;
    }
}

TEST(OpaqueFirst, NeitherListsNorCountsWhereNothingIsTransparent) {
    const auto passes = [](const Scene& scene) {
        CaptureSettings settings;
        settings.composite = true;
        const PosedScene shown(scene, 0);
        GlRenderer renderer(sharedContext(), shown);
        const auto result = capture(renderer, testView(40, 30), settings);
        return std::pair(result.report.passes, renderer.takeTimes().contains("count"));
    };
    SceneBuilder builder;
    builder.rectangle(1, 1, -3, builder.material({1, 0, 0, 1}, AlphaMode::kOpaque));
    builder.rectangle(1, 1, -2, builder.material({0, 1, 0, 1}, AlphaMode::kMask));
    EXPECT_EQ(passes(builder.scene()), std::pair(1, false));
    builder.rectangle(1, 1, -4, builder.material({0, 0, 1, 0.5F}));
    EXPECT_EQ(passes(builder.scene()), std::pair(1, true)) << "nothing is in front";
    builder.rectangle(1, 1, -1, builder.material({0, 0, 1, 0.5F}));
    EXPECT_EQ(passes(builder.scene()), std::pair(2, true));
}

// Layer limits and approximations depend on all fragments, including hidden ones.
TEST(OpaqueFirst, LeavesLimitsAndApproximationsAlone) {
    const Scene scene = mixed(hardScenes()[0].scene, 0);
    const std::size_t all = capture(scene, testView(160, 120)).image.fragments();
    const auto counted = [&](CaptureSettings settings) {
        settings.composite = true;
        return capture(scene, testView(160, 120), settings).plan.fragments_counted;
    };
    EXPECT_LT(counted({}), all);
    EXPECT_EQ(counted({.max_layers = 2}), all);
    EXPECT_EQ(counted({.occlusion_ratio = 0.01}), all);
    for (const auto& method : peelMethods()) {
        if (method.exact()) continue;
        EXPECT_EQ(counted({.method = std::string(method.name)}), all) << method.name;
    }
}

TEST(OpaqueFirst, EqualsTheCompositeOfAllLayersOfTheExampleScenes) {
    std::size_t scenes = 0;
    for (const auto& path : modelFiles(sourceDir() / "examples" / "scenes")) {
        ++scenes;
        const Scene scene = readGltf(path);
        cmd::CameraOptions camera;
        camera.size = exhaustive() ? Size{240, 135} : Size{120, 68};
        const PosedScene contained(scene, 0);
        const View view = cmd::makeView(contained, SceneExtent(contained), camera);
        for (const int samples : {1, 4}) {
            CaptureSettings settings;
            settings.samples = samples;
            expectTheSame(scene, view, settings, path.filename().string());
        }
    }
    EXPECT_GE(scenes, 5U);
}

}  // namespace
}  // namespace peeler::test
