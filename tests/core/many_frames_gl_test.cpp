// SPDX-License-Identifier: Apache-2.0
// A renderer that goes on for a thousand frames makes no more GL objects than for ten.
#include <gtest/gtest.h>

#include <array>
#include <cstdio>

#include "core/gl/functions.h"
#include "core/pose.h"
#include "core/renderer.h"
#include "formats/gltf_reader.h"
#include "support/capture.h"
#include "support/test_support.h"

namespace peeler::test {
namespace {

/// The lowest names that are free, of every kind of object: drivers hand them out again, so that
/// they grow with what is not deleted.
std::array<GLuint, 7> freeNames(const gl::Functions& gl) {
    std::array<GLuint, 7> names{};
    gl.CreateBuffers(1, &names[0]);
    gl.CreateTextures(GL_TEXTURE_2D, 1, &names[1]);
    gl.CreateFramebuffers(1, &names[2]);
    gl.CreateVertexArrays(1, &names[3]);
    gl.CreateSamplers(1, &names[4]);
    names[5] = gl.CreateProgram();
    names[6] = gl.CreateShader(GL_FRAGMENT_SHADER);
    gl.DeleteBuffers(1, &names[0]);
    gl.DeleteTextures(1, &names[1]);
    gl.DeleteFramebuffers(1, &names[2]);
    gl.DeleteVertexArrays(1, &names[3]);
    gl.DeleteSamplers(1, &names[4]);
    gl.DeleteProgram(names[5]);
    gl.DeleteShader(names[6]);
    return names;
}

TEST(ManyFrames, MakeNoMoreObjects) {
    const Scene scene = readGltf(sourceDir() / "examples" / "scenes" / "jellyfish.glb");
    const int playing[] = {0};
    const auto at = [&](int frame) {
        return contents(scene, 0, poseAt(scene, playing, frame / 24.0));
    };
    const auto context = gl::createContext({.backend = testBackend()});
    Renderer renderer(*context, scene, at(0));
    View view = testView(48, 27);
    view.camera_to_world[3] = {0, 1, 8, 1};
    // With channels, shadows, and a budget under which buffers come and go.
    CaptureSettings settings;
    settings.shadows = true;
    settings.shadow_size = 64;
    settings.channels = {Channel::kNormal, Channel::kMotion};
    std::array<GLuint, 7> after_ten{};
    for (int frame = 1; frame <= 1000; ++frame) {
        settings.memory = frame % 3 == 0 ? std::uint64_t{1} << 30 : 0;
        renderer.setContents(at(frame));
        renderer.setNextFrame({at(frame + 1), view});
        const Plan plan = renderer.plan(view, settings);
        CollectSink sink;
        Sink* const sinks[] = {&sink};
        renderer.capture(sinks);
        ASSERT_GT(plan.fragments_stored, 0U);
        ASSERT_EQ(sink.image.fragments(), plan.fragments_stored);
        if (frame == 10) after_ten = freeNames(context->functions());
    }
    EXPECT_EQ(freeNames(context->functions()), after_ten);
}

}  // namespace
}  // namespace peeler::test
