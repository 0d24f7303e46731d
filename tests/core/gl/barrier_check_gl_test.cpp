// SPDX-License-Identifier: Apache-2.0
// Tests PEELER_CHECK_BARRIERS, which reports missing barriers between passes. (The tests labelled
// gl, cli and assets set this variable, so all their drawing is checked.)
#include <gtest/gtest.h>

#include <cstdlib>
#include <functional>
#include <initializer_list>
#include <memory>
#include <string>

#include <peeler/error.h>
#include "core/gl/context.h"
#include "core/gl/objects.h"
#include "support/capture.h"
#include "support/test_support.h"

namespace peeler::test {
namespace {

constexpr const char* kWriter =
    "#version 450 core\nlayout(local_size_x = 1) in;\n"
    "layout(std430, binding = 0) buffer Numbers { uint numbers[]; };\n"
    "void main() { numbers[0] += 1u; }\n";
constexpr const char* kReader =
    "#version 450 core\nlayout(local_size_x = 1) in;\n"
    "layout(std430, binding = 0) readonly buffer Numbers { uint numbers[]; };\n"
    "layout(std430, binding = 1) writeonly buffer Copies { uint copies[]; };\n"
    "void main() { copies[0] = numbers[0]; }\n";

constexpr const char* kVertex =
    "#version 450 core\nvoid main() { gl_Position = vec4(0.0, 0.0, 0.0, 1.0); }\n";
constexpr const char* kCounter =
    "#version 450 core\nlayout(std430, binding = 0) buffer Numbers { uint numbers[]; };\n"
    "void main() { atomicAdd(numbers[0], 1u); }\n";

struct Stage {
    GLenum type;
    const char* text;
};

GLuint programOf(const gl::Functions& gl, std::initializer_list<Stage> stages) {
    const GLuint program = gl.CreateProgram();
    for (const Stage& stage : stages) {
        const GLuint shader = gl.CreateShader(stage.type);
        gl.ShaderSource(shader, 1, &stage.text, nullptr);
        gl.CompileShader(shader);
        gl.AttachShader(program, shader);
        gl.DeleteShader(shader);
    }
    gl.LinkProgram(program);
    return program;
}

/// Compute passes that access two buffers, in a checked context.
struct Passes {
    const gl::Functions& gl;
    gl::Buffer numbers{gl, 16}, copies{gl, 16};
    GLuint writer = programOf(gl, {{GL_COMPUTE_SHADER, kWriter}}),
           reader = programOf(gl, {{GL_COMPUTE_SHADER, kReader}});

    void run(GLuint program) const {
        numbers.bindStorage(0);
        copies.bindStorage(1);
        gl.UseProgram(program);
        gl.DispatchCompute(1, 1, 1);
    }
    void barrier() const { gl.MemoryBarrier(GL_SHADER_STORAGE_BARRIER_BIT); }
};

/// Returns the error that the check reports for `act`; "" if there is none.
std::string complaint(const std::function<void(const Passes&)>& act) {
    constexpr const char* kName = "PEELER_CHECK_BARRIERS";
    const bool was_set = std::getenv(kName) != nullptr;
    setenv(kName, "1", 1);
    std::string said;
    inOwnThread([&] {
        const auto context = gl::createContext({.backend = testBackend()});
        const Passes passes{context->functions()};
        try {
            act(passes);
        } catch (const Error& error) {
            EXPECT_EQ(error.kind(), ErrorKind::kInternal);
            said = error.what();
        }
        passes.gl.DeleteProgram(passes.writer);
        passes.gl.DeleteProgram(passes.reader);
    });
    if (!was_set) unsetenv(kName);
    return said;
}

/// Returns the error for two consecutive passes, with or without a barrier between them.
std::string complaintOf(GLuint Passes::*first, GLuint Passes::*second, bool barrier) {
    return complaint([&](const Passes& passes) {
        passes.run(passes.*first);
        if (barrier) passes.barrier();
        passes.run(passes.*second);
    });
}

TEST(BarrierCheck, WantsOneBeforeWhatAPassWroteIsRead) {
    EXPECT_TRUE(complaintOf(&Passes::writer, &Passes::reader, false)
                    .starts_with("no barrier before the use of block Numbers"));
    EXPECT_EQ(complaintOf(&Passes::writer, &Passes::reader, true), "");
}

TEST(BarrierCheck, WantsOneBeforeWhatAPassReadsIsWritten) {
    EXPECT_TRUE(complaintOf(&Passes::reader, &Passes::writer, false)
                    .starts_with("no barrier before the write to block Numbers"));
    EXPECT_EQ(complaintOf(&Passes::reader, &Passes::writer, true), "");
}

// A barrier for shader accesses does not cover CPU accesses.
TEST(BarrierCheck, WantsOneBeforeTheCpuReadsOrClears) {
    EXPECT_NE(complaint([](const Passes& passes) {
                  passes.run(passes.writer);
                  passes.barrier();
                  passes.numbers.read(4);
              }),
              "");
    EXPECT_NE(complaint([](const Passes& passes) {
                  passes.run(passes.writer);
                  passes.barrier();
                  passes.numbers.clearToZero(4);
              }),
              "");
    EXPECT_EQ(complaint([](const Passes& passes) {
                  passes.numbers.clearToZero(4);
                  passes.run(passes.writer);
                  gl::waitForGpu(passes.gl);
                  EXPECT_EQ(*passes.numbers.read(4).as<const GLuint>(), 1U);
                  passes.numbers.clearToZero(4);
              }),
              "");
}

// Binding a framebuffer begins a pass. Within a pass no barrier is needed, because shaders use
// atomics or write to disjoint elements.
TEST(BarrierCheck, WantsNoneWithinAPass) {
    const auto draws = [](const Passes& passes, bool in_one_pass) {
        const gl::Functions& gl = passes.gl;
        const auto framebuffer = gl::makeEmptyFramebuffer(gl, 1, 1);
        GLuint name = 0;
        gl.CreateVertexArrays(1, &name);
        const gl::VertexArray none(gl, name);
        const GLuint program =
            programOf(gl, {{GL_VERTEX_SHADER, kVertex}, {GL_FRAGMENT_SHADER, kCounter}});
        gl.BindVertexArray(none.name());
        passes.numbers.bindStorage(0);
        gl.UseProgram(program);
        gl.BindFramebuffer(GL_FRAMEBUFFER, framebuffer.name());
        gl.DrawArrays(GL_TRIANGLES, 0, 3);
        if (!in_one_pass) gl.BindFramebuffer(GL_FRAMEBUFFER, framebuffer.name());
        gl.DrawArrays(GL_TRIANGLES, 0, 3);
    };
    EXPECT_EQ(complaint([&](const Passes& passes) { draws(passes, true); }), "");
    EXPECT_NE(complaint([&](const Passes& passes) { draws(passes, false); }), "");
}

TEST(BarrierCheck, WantsABufferForEachBlock) {
    EXPECT_EQ(complaint([](const Passes& passes) {
                  passes.numbers.bindStorage(0);
                  passes.gl.UseProgram(passes.reader);
                  passes.gl.DispatchCompute(1, 1, 1);
              }),
              "no buffer is bound for block Copies");
}

}  // namespace
}  // namespace peeler::test
