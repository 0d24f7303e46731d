// SPDX-License-Identifier: Apache-2.0
// Tests the library as clients use it: custom scenes, errors, cancellation, threads, files.
#include <gtest/gtest.h>

#include <array>
#include <atomic>
#include <cmath>
#include <stdexcept>
#include <thread>

#include <peeler/error.h>
#include <peeler/files.h>
#include <peeler/gltf_options.h>
#include <peeler/renderer.h>
#include "support/capture.h"
#include "support/test_support.h"

namespace peeler::test {
namespace {

/// Returns two 2 x 2 squares at Z = 0 and 1. The tests view them orthographically from above.
std::shared_ptr<const Scene> twoSquares() {
    Scene scene;
    scene.materials.emplace_back();
    scene.materials[0].double_sided = true;
    Primitive square;
    square.positions = {{-1, -1, 0}, {1, -1, 0}, {1, 1, 0}, {-1, 1, 0}};
    square.indices = {0, 1, 2, 0, 2, 3};
    scene.meshes.push_back({"square", {square}});
    scene.nodes.resize(2);
    for (Node& node : scene.nodes)
        node.mesh = 0;
    scene.nodes[1].local[3] = {0, 0, 1, 1};
    scene.scenes.push_back({"", {0, 1}});
    return std::make_shared<const Scene>(std::move(scene));
}

CameraChoice fromAbove() {
    CameraChoice camera;
    camera.eye = {0, 0, 3};
    camera.target = {0, 0, 0};
    camera.ortho_height = 4;
    camera.size = {32, 32};
    return camera;
}

RendererOptions ofTests() {
    RendererOptions options;
    options.backend = testBackend();
    return options;
}

template <class Call>
ErrorKind kindOf(Call&& call) {
    try {
        call();
    } catch (const Error& error) {
        return error.kind();
    }
    return ErrorKind::kInternal;
}

TEST(Library, RendersScenesMadeOfArrays) {
    const Shown shown{twoSquares()};
    Renderer renderer(ofTests());
    const View view = viewOf(shown, fromAbove());
    const LayeredImage image = renderer.layers(shown, view);
    // The squares fill a quarter of the picture, 16 x 16 pixels: two layers, at distances 2 and 3.
    ASSERT_EQ(image.fragments(), 2U * 16 * 16);
    for (int y = 0; y < 32; ++y) {
        for (int x = 0; x < 32; ++x) {
            const std::size_t pixel = image.pixelIndex(x, y);
            const bool inside = x >= 8 && x < 24 && y >= 8 && y < 24;
            ASSERT_EQ(image.count(pixel), inside ? 2U : 0U);
            if (!inside) continue;
            EXPECT_NEAR(image.z[image.offsets[pixel]], 2, 1e-5);
            EXPECT_NEAR(image.z[image.offsets[pixel] + 1], 3, 1e-5);
        }
    }
    const CompositeImage composite = renderer.composite(shown, view);
    EXPECT_EQ(composite.rgba[image.pixelIndex(16, 16)][3], 1);
    EXPECT_EQ(composite.rgba[0][3], 0);
    EXPECT_FALSE(renderer.device().empty());
}

TEST(Library, GivesTheLayersOfTheRendererWithin) {
    const Shown shown{readScene(sourceDir() / "examples" / "scenes" / "glasses.glb")};
    CameraChoice camera;
    camera.size = {96, 72};
    const View view = viewOf(shown, camera);
    CaptureSettings settings;
    settings.tinted = true;
    settings.channels = {Channel::kNormal, Channel::kId};
    const LayeredImage image = Renderer(ofTests()).layers(shown, view, settings);
    const Captured within = capture(*shown.scene, view, settings);
    EXPECT_EQ(difference(image, within.image), "");
    EXPECT_GT(image.fragments(), 1000U);
}

TEST(Library, FindsTheSameHitsWithAndWithoutGl) {
    const Shown shown{twoSquares()};
    Renderer renderer(ofTests());
    const Bounds box = *boundsOf(shown);
    const Bundle bundle = parallelBundle("down", box, box, {0, 0, -1}, {.resolution = 64});
    const LayeredImage cpu = renderer.rays(shown, bundle, raySettings(), RayEngine::kCpu);
    const LayeredImage gl = renderer.rays(shown, bundle, raySettings(), RayEngine::kGl);
    EXPECT_EQ(cpu.fragments(), 2U * 64 * 64);
    EXPECT_EQ(difference(cpu, gl), "");
}

TEST(Library, FindsTheSplatsThatRaysHit) {
    Scene scene = *twoSquares();
    const auto splat = std::make_shared<Splats>();
    splat->scales = {glm::vec3(0.1F)};
    splat->rotations = {{0, 0, 0, 1}};
    splat->opacities = {0.5F};
    splat->harmonics = {glm::vec3(0)};
    Primitive cloud;
    cloud.topology = Topology::kPoints;
    cloud.positions = {{0, 0, 0.5F}};
    cloud.splats = splat;
    scene.meshes.push_back({"cloud", {cloud}});
    scene.nodes.emplace_back().mesh = 1;
    scene.scenes.front().roots.push_back(2);
    const Shown shown{std::make_shared<const Scene>(std::move(scene))};
    Renderer renderer(ofTests());
    const Bounds box = *boundsOf(shown);
    const Bundle bundle = parallelBundle("down", box, box, {0, 0, -1}, {.resolution = 65});
    const LayeredImage cpu = renderer.rays(shown, bundle, raySettings(), RayEngine::kCpu);
    const LayeredImage gl = renderer.rays(shown, bundle, raySettings(), RayEngine::kGl);
    EXPECT_EQ(difference(cpu, gl), "");
    const std::size_t middle = cpu.pixelIndex(32, 32);
    ASSERT_EQ(cpu.count(middle), 3U);
    EXPECT_NEAR(color(cpu, cpu.offsets[middle] + 1).a, 0.5, 1e-6);
    EXPECT_EQ(cpu.count(0), 2U);
}

TEST(Library, FindsNoHitsOnTheCpuWhereItMustHaveAGpu) {
    if (!sharedContext().device().software) GTEST_SKIP() << "there is a GPU";
    const Shown shown{twoSquares()};
    const Bounds box = *boundsOf(shown);
    const Bundle bundle = parallelBundle("down", box, box, {0, 0, -1}, {.resolution = 4});
    RendererOptions options;
    options.require_gpu = true;
    Renderer renderer(options);
    EXPECT_EQ(kindOf([&] { renderer.rays(shown, bundle, raySettings()); }), ErrorKind::kDevice);
    EXPECT_EQ(renderer.rays(shown, bundle, raySettings(), RayEngine::kCpu).fragments(), 32U);
}

TEST(Library, CanBeUsedOnAfterErrors) {
    const Shown shown{twoSquares()};
    Renderer renderer(ofTests());
    const View view = viewOf(shown, fromAbove());
    CaptureSettings unknown;
    unknown.method = "guessing";
    EXPECT_EQ(kindOf([&] { renderer.layers(shown, view, unknown); }), ErrorKind::kUsage);
    EXPECT_EQ(kindOf([&] { renderer.layers({}, view); }), ErrorKind::kUsage);
    CameraChoice camera;
    camera.camera = "nobody";
    EXPECT_EQ(kindOf([&] { viewOf(shown, camera); }), ErrorKind::kUsage);
    EXPECT_EQ(renderer.layers(shown, view).fragments(), 512U);
}

TEST(Library, RefusesScenesThatAreNone) {
    const auto refused = [](auto&& change) {
        Scene scene = *twoSquares();
        change(scene);
        return kindOf([&] { checkScene(scene); }) == ErrorKind::kUsage;
    };
    EXPECT_FALSE(refused([](Scene&) {}));
    EXPECT_TRUE(refused([](Scene& s) { s.scenes.clear(); }));
    EXPECT_TRUE(refused([](Scene& s) { s.scenes[0].roots = {2}; }));
    EXPECT_TRUE(refused([](Scene& s) { s.materials.clear(); }));
    const auto splats = [](std::size_t count, int degree) {
        return [=](Scene& s) {
            Primitive& primitive = s.meshes[0].primitives[0];
            auto of_points = std::make_shared<Splats>();
            of_points->degree = degree;
            of_points->scales.resize(count);
            of_points->rotations.resize(count);
            of_points->opacities.resize(count);
            of_points->harmonics.resize(count * of_points->coefficients());
            primitive.splats = of_points;
            primitive.topology = Topology::kPoints;
            primitive.indices.clear();
        };
    };
    const std::size_t points = twoSquares()->meshes[0].primitives[0].positions.size();
    EXPECT_FALSE(refused(splats(points, 3)));
    EXPECT_TRUE(refused(splats(points - 1, 0)));
    EXPECT_TRUE(refused(splats(points, 4)));
    EXPECT_TRUE(refused([](Scene& s) { s.nodes[0].mesh = 1; }));
    EXPECT_TRUE(refused([](Scene& s) { s.nodes[0].skin = 0; }));
    EXPECT_TRUE(refused([](Scene& s) { s.nodes[0].children = {0}; }));
    EXPECT_TRUE(refused([](Scene& s) { s.nodes[0].children = {1, 1}; }));
    EXPECT_TRUE(refused([](Scene& s) { s.materials[0].base_color_texture.image = 0; }));
    EXPECT_TRUE(refused([](Scene& s) { s.images.push_back({"", 2, 2, {}}); }));
    EXPECT_TRUE(refused([](Scene& s) { s.meshes[0].primitives[0].indices[0] = 4; }));
    EXPECT_TRUE(refused([](Scene& s) { s.meshes[0].primitives[0].indices.pop_back(); }));
    EXPECT_TRUE(refused([](Scene& s) { s.meshes[0].primitives[0].normals.resize(3); }));
    EXPECT_TRUE(refused([](Scene& s) { s.meshes[0].primitives[0].material = -1; }));
    Scene broken = *twoSquares();
    broken.nodes[1].mesh = 7;
    const Shown shown{std::make_shared<const Scene>(std::move(broken))};
    EXPECT_EQ(kindOf([&] { viewOf(shown); }), ErrorKind::kUsage);
}

TEST(Library, GivesUpWhereProgressThrows) {
    const Shown shown{readScene(sourceDir() / "examples" / "scenes" / "engine.glb")};
    CameraChoice camera;
    camera.size = {1024, 768};
    const View view = viewOf(shown, camera);
    Renderer renderer(ofTests());
    const std::thread::id caller = std::this_thread::get_id();
    int calls = 0;
    EXPECT_THROW(renderer.layers(shown, view, {},
                                 [&](double) {
                                     ++calls;
                                     EXPECT_EQ(std::this_thread::get_id(), caller);
                                     throw std::runtime_error("enough");
                                 }),
                 std::runtime_error);
    EXPECT_EQ(calls, 1);
    camera.size = {64, 48};
    double last = 0;
    const LayeredImage image = renderer.layers(shown, viewOf(shown, camera), {}, [&](double share) {
        EXPECT_GE(share, last);
        last = share;
    });
    EXPECT_EQ(last, 1);
    EXPECT_GT(image.fragments(), 0U);
}

TEST(Library, IsUsedFromOtherThreads) {
    const Shown shown{twoSquares()};
    const View view = viewOf(shown, fromAbove());
    std::array<Renderer, 2> renderers{Renderer(ofTests()), Renderer(ofTests())};
    std::atomic<std::size_t> fragments = 0;
    std::vector<std::thread> threads;
    for (int i = 0; i < 4; ++i) {
        threads.emplace_back([&, i] {
            for (int again = 0; again < 3; ++again)
                fragments +=
                    renderers[static_cast<std::size_t>(i % 2)].layers(shown, view).fragments();
        });
    }
    for (std::thread& thread : threads)
        thread.join();
    EXPECT_EQ(fragments, 4U * 3 * 512);
}

TEST(Library, LeavesTheCallersContextCurrent) {
    inOwnThread([] {
        const auto own = gl::createContext({.backend = testBackend()});
        const Shown shown{twoSquares()};
        const View view = viewOf(shown, fromAbove());
        // This renderer is created before the library runs and used afterwards. If the library left
        // another context current, this renderer's objects would be invalid.
        const PosedScene posed(*shown.scene, 0);
        GlRenderer within(*own, posed);
        const Captured before = capture(within, view);
        {
            Renderer renderer(ofTests());
            EXPECT_EQ(difference(renderer.layers(shown, view), before.image), "");
        }
        EXPECT_EQ(difference(capture(within, view).image, before.image), "");
    });
}

TEST(Library, KeepsToItsMemory) {
    if (kShadowMemory) GTEST_SKIP() << "its memory is not the product's";
    RendererOptions options = ofTests();
    options.memory = std::uint64_t{256} << 20;
    const Shown shown{readScene(sourceDir() / "examples" / "scenes" / "engine.glb")};
    CameraChoice camera;
    camera.size = {4096, 4096};
    Renderer renderer(options);
    EXPECT_EQ(kindOf([&] { renderer.layers(shown, viewOf(shown, camera)); }), ErrorKind::kMemory);
    camera.size = {64, 64};
    EXPECT_GT(renderer.layers(shown, viewOf(shown, camera)).fragments(), 0U);
}

TEST(Library, WritesAndReadsFiles) {
    const ScratchDir scratch;
    const Shown shown{twoSquares()};
    const View view = viewOf(shown, fromAbove());
    Renderer renderer(ofTests());
    const std::string path = (scratch.path() / "layers.exr").string();
    const auto sink = openFile(path);
    renderer.capture(shown, view, {}, *sink);
    const LayeredImage image = renderer.layers(shown, view);
    const StoredLayers stored = readLayers(path);
    EXPECT_EQ(stored.image.offsets, image.offsets);
    EXPECT_EQ(stored.image.z, image.z);
    const std::string again = (scratch.path() / "again.exr").string();
    writeLayers(again, stored);
    EXPECT_EQ(difference(readLayers(again).image, stored.image), "");
}

}  // namespace
}  // namespace peeler::test
