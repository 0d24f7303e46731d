// SPDX-License-Identifier: Apache-2.0
// Tests layers in GL buffers of a borrowed context: counts, offsets, depths, colours, bands, order.
#include <peeler/gl_layers.h>

#include <gtest/gtest.h>

#include <array>
#include <functional>
#include <limits>
#include <memory>
#include <string>
#include <utility>
#include <vector>

#include <peeler/error.h>
#include <peeler/files.h>
#include <peeler/renderer.h>
#include "core/gl/functions.h"
#include "core/gl/objects.h"
#include "support/borrowed_context.h"
#include "support/capture.h"
#include "support/method_names.h"
#include "support/test_support.h"

namespace peeler::test {
namespace {

/// Runs the test with a Renderer that borrows a new context.
void borrow(const std::function<void(Renderer&, const gl::Functions&)>& test) {
    inOwnThread([&] {
        const auto context = gl::createContext({.backend = testBackend()});
        Renderer renderer(borrowing());
        test(renderer, context->functions());
        EXPECT_EQ(context->functions().GetError(), static_cast<GLenum>(GL_NO_ERROR));
    });
}

Shown share(const SceneBuilder& builder) {
    return {std::make_shared<const Scene>(builder.scene())};
}

/// Returns rectangles at these depths, in this draw order, each in a colour of its own. A 4 x 4
/// pixel picture of testView() shows all of them in its two middle columns, and none in the others.
Shown rectangles(const std::vector<float>& depths) {
    SceneBuilder builder;
    for (std::size_t i = 0; i < depths.size(); ++i) {
        const float share = static_cast<float>(i + 1) / static_cast<float>(depths.size());
        const int glass = builder.material({share, 0.25, 1 - share, 0.5});
        builder.rectangle(0.25F * depths[i], depths[i], -depths[i], glass);
    }
    return share(builder);
}

/// Returns all bands of glLayers(), joined.
LayeredImage allBands(Renderer& renderer, const Shown& shown, const View& view,
                      const CaptureSettings& settings = {}, int* bands = nullptr) {
    CollectSink joined;
    for (GlLayers band = renderer.glLayers(shown, view, settings); !band.window.empty();
         band = renderer.nextGlLayers())
        joined.write(readBack(band));
    if (bands) *bands = static_cast<int>(joined.bands.size());
    return std::move(joined.image);
}

void expectLayers(Renderer& renderer, const Shown& shown, const View& view,
                  const CaptureSettings& settings, const std::string& where) {
    const LayeredImage on_gpu = allBands(renderer, shown, view, settings);
    EXPECT_EQ(difference(on_gpu, renderer.layers(shown, view, settings)), "") << where;
}

TEST(GlLayers, HoldRectanglesOfKnownColourAndDepth) {
    borrow([](Renderer& renderer, const gl::Functions& gl) {
        const Shown shown = rectangles({3, 1, 2, 1});
        CaptureSettings settings;
        settings.color_type = PixelType::kFloat;
        const GlLayers layers = renderer.glLayers(shown, testView(4, 4), settings);
        // Mapping throws if a barrier is missing (PEELER_CHECK_BARRIERS).
        for (const unsigned name : {layers.counts, layers.offsets, layers.depths, layers.colors})
            const gl::Buffer::Mapping mapping(gl, name, 4, GL_MAP_READ_BIT);
        EXPECT_EQ(layers.window, (Window{0, 0, 4, 4}));
        EXPECT_EQ(layers.fragments, 4U * 8);
        EXPECT_EQ(layers.layers, 4U);
        EXPECT_EQ(layers.colorStride(), 16U);
        const LayeredImage image = readBack(layers);
        for (std::size_t p = 0; p < 16; ++p) {
            const bool middle = p % 4 == 1 || p % 4 == 2;
            ASSERT_EQ(image.count(p), middle ? 4U : 0U);
            if (!middle) continue;
            const std::size_t first = image.offsets[p];
            // The rectangles at depth 1 come in draw order: the second and the fourth.
            const std::array<float, 4> drawn = {2, 4, 3, 1}, depths = {1, 1, 2, 3};
            for (std::size_t i = 0; i < 4; ++i) {
                EXPECT_FLOAT_EQ(image.z[first + i], depths[i]);
                const float share = drawn[i] / 4;
                EXPECT_EQ(color(image, first + i),
                          glm::vec4(0.5F * share, 0.125F, 0.5F * (1 - share), 0.5F));
            }
        }
        EXPECT_TRUE(renderer.nextGlLayers().window.empty());
    });
}

TEST(GlLayers, AreTheLayersOfEveryMethodTypeAndLimit) {
    borrow([](Renderer& renderer, const gl::Functions&) {
        const Shown shown = rectangles({3, 1, 2.5F, 1, 2, 4, 1.5F});
        for (const std::string& method : methodNames(true)) {
            for (const PixelType type : {PixelType::kHalf, PixelType::kFloat}) {
                for (const std::uint32_t limit : {0U, 3U}) {
                    CaptureSettings settings;
                    settings.method = method;
                    settings.color_type = type;
                    settings.max_layers = limit;
                    expectLayers(renderer, shown, testView(12, 9), settings,
                                 method + " " + std::to_string(limit));
                }
            }
        }
    });
}

TEST(GlLayers, AreTheLayersOfLongLists) {
    borrow([](Renderer& renderer, const gl::Functions&) {
        std::vector<float> depths;
        for (int i = 0; i < 150; ++i)
            depths.push_back(1 + 0.03125F * static_cast<float>(i * 37 % 101));
        expectLayers(renderer, rectangles(depths), testView(4, 4), {}, "150 rectangles");
    });
}

TEST(GlLayers, AreTheLayersOfTintedGlassAndOfEveryProjection) {
    borrow([](Renderer& renderer, const gl::Functions&) {
        const Shown shown{readScene(sourceDir() / "examples" / "scenes" / "glasses.glb")};
        CameraChoice camera;
        camera.size = {48, 36};
        View view = viewOf(shown, camera);
        CaptureSettings settings;
        expectLayers(renderer, shown, view, settings, "no far plane");
        view.projection.far = 5;
        settings.color_type = PixelType::kFloat;
        settings.surfaces = Surfaces::kVisible;
        expectLayers(renderer, shown, view, settings, "a far plane");
        camera.eye = {0, 0, 3};
        camera.target = {0, 0, 0};
        camera.ortho_height = 2;
        expectLayers(renderer, shown, viewOf(shown, camera), {}, "orthographic");
    });
}

TEST(GlLayers, ComeInBandsThatCoverTheCrop) {
    borrow([](Renderer& renderer, const gl::Functions&) {
        const Shown shown = rectangles({3, 1, 2, 1});
        View view = testView(64, 48);
        view.crop = {5, 7, 60, 41};
        int bands = 0;
        CaptureSettings settings;
        const LayeredImage whole = allBands(renderer, shown, view, settings, &bands);
        EXPECT_EQ(bands, 1);
        settings.band_bytes = 64 << 10;
        EXPECT_EQ(difference(allBands(renderer, shown, view, settings, &bands), whole), "");
        EXPECT_GE(bands, 4);
        EXPECT_EQ(difference(renderer.layers(shown, view), whole), "");
    });
}

TEST(GlLayers, MayBeEmpty) {
    borrow([](Renderer& renderer, const gl::Functions&) {
        SceneBuilder builder;
        builder.rectangle(1, 1, 2, builder.material({1, 1, 1, 1}));  // behind the camera
        const GlLayers layers = renderer.glLayers(share(builder), testView(4, 4));
        EXPECT_EQ(layers.fragments, 0U);
        EXPECT_EQ(readBack(layers).offsets, std::vector<std::uint32_t>(17));
        EXPECT_TRUE(layers.colors && layers.depths);
    });
}

TEST(GlLayers, AreValidUntilTheNextCall) {
    borrow([](Renderer& renderer, const gl::Functions& gl) {
        const Shown shown = rectangles({3, 1, 2, 1});
        const GlLayers small = renderer.glLayers(shown, testView(8, 6));
        const LayeredImage image = readBack(small);
        EXPECT_EQ(renderer.glLayers(shown, testView(8, 6)).colors, small.colors) << "reused";
        EXPECT_EQ(difference(readBack(small), image), "");
        // A larger picture needs other buffers; the host's bindings to the earlier buffers end.
        gl.BindBufferBase(GL_SHADER_STORAGE_BUFFER, 3, small.offsets);
        gl.BindBufferBase(GL_SHADER_STORAGE_BUFFER, 1, small.colors);
        const GlLayers large = renderer.glLayers(shown, testView(80, 60));
        const auto bound = [&](GLuint index) {
            GLint name = -1;
            gl.GetIntegeri_v(GL_SHADER_STORAGE_BUFFER_BINDING, index, &name);
            return static_cast<GLuint>(name);
        };
        const auto is_buffer = reinterpret_cast<PFNGLISBUFFERPROC>(functionOf("glIsBuffer"));
        for (const auto& [index, name] : {std::pair{3U, small.offsets}, {1U, small.colors}})
            EXPECT_EQ(bound(index), is_buffer(name) ? name : 0U);
        EXPECT_EQ(difference(readBack(large), renderer.layers(shown, testView(80, 60))), "");
    });
}

/// Expects that the call throws a usage error with a hint at this place.
void expectUsage(const std::function<void()>& call, const std::string& where) {
    try {
        call();
        ADD_FAILURE() << "no error: " << where;
    } catch (const Error& error) {
        EXPECT_EQ(error.kind(), ErrorKind::kUsage);
        EXPECT_TRUE(contains(error.where(), where)) << error.where();
        EXPECT_FALSE(error.hint().empty());
    }
}

TEST(GlLayers, NeedABorrowedContext) {
    RendererOptions options;
    options.backend = testBackend();
    Renderer renderer(options);
    expectUsage([&] { renderer.glLayers(rectangles({1}), testView(4, 4)); },
                "RendererOptions::adopt");
    expectUsage([&] { renderer.nextGlLayers(); }, "nextGlLayers()");
}

TEST(GlLayers, RefuseWhatTheCpuComputes) {
    borrow([](Renderer& renderer, const gl::Functions&) {
        const Shown shown = rectangles({1});
        const auto refused = [&](auto&& change, const std::string& where) {
            CaptureSettings settings;
            change(settings);
            expectUsage([&] { renderer.glLayers(shown, testView(4, 4), settings); }, where);
        };
        refused([](CaptureSettings& s) { s.composite = true; }, "composite");
        refused([](CaptureSettings& s) { s.hit_mode = HitMode::kRaw; }, "hit_mode");
        refused([](CaptureSettings& s) { s.channels = {Channel::kId}; }, "channels");
        refused([](CaptureSettings& s) { s.samples = 4; }, "samples");
        refused([](CaptureSettings& s) { s.method = "weighted-sum"; }, "method");
        EXPECT_EQ(renderer.glLayers(shown, testView(4, 4)).fragments, 8U);
    });
}

TEST(GlLayers, EndWithAnotherCapture) {
    borrow([](Renderer& renderer, const gl::Functions&) {
        const Shown shown = rectangles({3, 1, 2, 1});
        const View view = testView(64, 48);
        CaptureSettings settings;
        settings.band_bytes = 64 << 10;
        const auto begin = [&] {
            ASSERT_LT(renderer.glLayers(shown, view, settings).window.y1, 48);
        };
        begin();
        EXPECT_FALSE(renderer.device().empty());
        EXPECT_GT(renderer.nextGlLayers().window.y0, 0) << "device() captures nothing";
        renderer.layers(shown, testView(4, 4));
        expectUsage([&] { renderer.nextGlLayers(); }, "nextGlLayers()");
        begin();
        settings.method = "weighted-sum";
        expectUsage([&] { renderer.layers(shown, view, settings); }, "method");
        expectUsage([&] { renderer.nextGlLayers(); }, "nextGlLayers()");
    });
}

TEST(GlLayers, ReportProgress) {
    borrow([](Renderer& renderer, const gl::Functions&) {
        double last = 0;
        const Progress progress = [&](double share) {
            EXPECT_GE(share, last);
            last = share;
        };
        renderer.glLayers(rectangles({1, 2}), testView(16, 12), {}, progress);
        EXPECT_EQ(last, 1);
    });
}

}  // namespace
}  // namespace peeler::test
