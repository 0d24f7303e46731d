// SPDX-License-Identifier: Apache-2.0
#include "core/gl/adopted_context.h"

#include <array>
#include <atomic>
#include <cstdint>

#include <peeler/error.h>

namespace peeler::gl {
namespace {

constexpr const char* kMakeCurrent = "make the borrowed context current";

/// Returns a label that is unique in the process, even if the process has loaded two copies of this
/// library.
std::string newLabel() {
    static std::atomic<std::uint64_t> last = 0;
    return "peeler " + std::to_string(reinterpret_cast<std::uintptr_t>(&last)) + ' ' +
           std::to_string(++last);
}

bool anyCurrent(const Functions& gl) {
    return gl.GetString(GL_VERSION) != nullptr;
}

[[noreturn]] void refuseNoContext(const char* hint) {
    throw Error(ErrorKind::kUsage, "no OpenGL context is current on this thread",
                "RendererOptions::adopt", hint);
}

}  // namespace

AdoptedContext::AdoptedContext(void* (*function_of)(const char* name)) : label_(newLabel()) {
    functions_ = std::make_unique<Functions>();
    Device device;
    device.backend = "adopted";
    const std::string missing = loadFunctions(*functions_, function_of);
    if (missing.empty() && !anyCurrent(*functions_))
        refuseNoContext("make an OpenGL 4.5 core context current first");
    device.problem =
        missing.empty() ? examine(*functions_, device) : "the function " + missing + " is missing";
    if (!device.problem.empty())
        throw Error(ErrorKind::kDevice, "the current context cannot be used: " + device.problem, "",
                    "make an OpenGL 4.5 core context current first");
    device_ = device;
    functions_->CreateVertexArrays(1, &mark_);
    functions_->ObjectLabel(GL_VERTEX_ARRAY, mark_, static_cast<GLsizei>(label_.size()),
                            label_.data());
}

AdoptedContext::~AdoptedContext() {
    if (current()) functions_->DeleteVertexArrays(1, &mark_);
}

bool AdoptedContext::current() const {
    const Functions& gl = functions();
    // The object must exist before its label is queried. Otherwise the query would raise a GL
    // error, possibly in another owner's context.
    if (!anyCurrent(gl) || gl.IsVertexArray(mark_) != GL_TRUE) return false;
    std::array<GLchar, 64> text{};
    GLsizei length = 0;
    gl.GetObjectLabel(GL_VERTEX_ARRAY, mark_, static_cast<GLsizei>(text.size()), &length,
                      text.data());
    return label_ == text.data();
}

void AdoptedContext::requireCurrent() const {
    if (current()) return;
    if (!anyCurrent(functions())) refuseNoContext(kMakeCurrent);
    throw Error(ErrorKind::kUsage, "this thread's current OpenGL context is not the borrowed one",
                "RendererOptions::adopt", kMakeCurrent);
}

void AdoptedContext::abandonObjects() {
    Functions& gl = *functions_;
    constexpr auto kNone = [](GLsizei, const GLuint*) {};
    gl.DeleteBuffers = kNone;
    gl.DeleteFramebuffers = kNone;
    gl.DeleteQueries = kNone;
    gl.DeleteSamplers = kNone;
    gl.DeleteTextures = kNone;
    gl.DeleteVertexArrays = kNone;
    gl.DeleteProgram = [](GLuint) {};
    gl.DeleteShader = [](GLuint) {};
    gl.DeleteSync = [](GLsync) {};
}

}  // namespace peeler::gl
