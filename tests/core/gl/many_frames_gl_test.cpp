// SPDX-License-Identifier: Apache-2.0
// Tests that a Renderer holds the same number of GL objects after ten frames and after a thousand
// (forty in the short run).
#include <dlfcn.h>
#include <gtest/gtest.h>

#include <map>
#include <string>

#include "core/capture/gl_renderer.h"
#include "core/gl/functions.h"
#include "core/scene/posed_scene.h"
#include "formats/gltf/gltf_reader.h"
#include "support/capture.h"
#include "support/test_support.h"

namespace peeler::test {
namespace {

/// Returns the address of a GL function that peeler itself does not use.
template <class Function>
Function loadFunction(const char* name) {
    const bool osmesa = testBackend() == "osmesa";
    void* library = dlopen(osmesa ? "libOSMesa.so.8" : "libEGL.so.1", RTLD_NOW | RTLD_LOCAL);
    EXPECT_NE(library, nullptr) << dlerror();
    using Loader = void* (*)(const char*);
    const auto loader = reinterpret_cast<Loader>(
        dlsym(library, osmesa ? "OSMesaGetProcAddress" : "eglGetProcAddress"));
    return reinterpret_cast<Function>(loader(name));
}

/// Returns the number of live objects of every kind. Checks every name that may ever have been
/// used, because some drivers do not reuse names.
std::map<std::string, int> objects() {
    constexpr GLuint kMostNames = 20000;
    std::map<std::string, int> counts;
    for (const char* kind :
         {"Buffer", "Texture", "Framebuffer", "VertexArray", "Sampler", "Program", "Shader"}) {
        const auto is = loadFunction<PFNGLISBUFFERPROC>(("glIs" + std::string(kind)).c_str());
        for (GLuint name = 1; name < kMostNames; ++name)
            counts[kind] += is(name) == GL_TRUE;
    }
    return counts;
}

void renderManyFrames() {
    const Scene scene = readGltf(sourceDir() / "examples" / "scenes" / "jellyfish.glb");
    const int playing[] = {0};
    const auto at = [&](int frame) {
        return PosedScene(scene, 0, poseAt(scene, playing, frame / 24.0));
    };
    const auto context = gl::createContext({.backend = testBackend()});
    GlRenderer renderer(*context, at(0));
    View view = testView(24, 14);
    view.camera_to_world[3] = {0, 1, 8, 1};
    CaptureSettings settings;
    settings.shadow_size = 64;
    constexpr std::uint64_t kTight = std::uint64_t{kShadowMemory ? 8 : 1} << 30;
    std::map<std::string, int> after_ten;
    const int frames = exhaustive() ? 1000 : 40;
    for (int frame = 1; frame <= frames; ++frame) {
        // Some frames use shadows and channels. The budget makes the renderer free and reallocate
        // buffers.
        settings.shadows = frame % 10 < 2;
        settings.channels.clear();
        if (frame % 10 == 1) settings.channels = {Channel::kNormal, Channel::kMotion};
        settings.memory = frame % 3 == 0 ? kTight : 0;
        renderer.setPose(at(frame));
        renderer.setNextFrame({at(frame + 1), view});
        const CapturePlan plan = renderer.plan(view, settings);
        CollectSink sink;
        renderer.capture(plan, sink);
        ASSERT_GT(plan.fragments_stored, 0U);
        ASSERT_EQ(sink.image.fragments(), plan.fragments_stored);
        if (frame == 10) after_ten = objects();
    }
    EXPECT_EQ(objects(), after_ten);
    EXPECT_GT(after_ten.at("Buffer"), 0);
    EXPECT_GT(after_ten.at("Program"), 0);
}

TEST(ManyFrames, MakeNoMoreObjects) {
    inOwnThread(renderManyFrames);
}

}  // namespace
}  // namespace peeler::test
