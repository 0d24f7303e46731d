// SPDX-License-Identifier: Apache-2.0
// Benchmark of ways to count and sort fragments on a GPU, including peeler's own. Prints medians in
// milliseconds as JSON; exits with 1 if two ways disagree.
//
//     gpu_choices [WIDTH HEIGHT RUNS]
#include "gpu/gpu_choices.h"

#include <algorithm>
#include <chrono>
#include <cstdio>
#include <cstdlib>
#include <exception>
#include <iterator>
#include <stdexcept>

#include "core/base/parallel.h"
#include "core/gl/context.h"

namespace peeler::benchmark {

double milliseconds(const Settings& settings, const std::function<void()>& prepare,
                    const std::function<void()>& work) {
    using Clock = std::chrono::steady_clock;
    std::vector<double> times;
    for (int run = 0; run <= settings.runs; ++run) {
        prepare();
        const Clock::time_point start = Clock::now();
        work();
        if (run > 0)
            times.push_back(
                std::chrono::duration<double, std::milli>(Clock::now() - start).count());
    }
    const auto middle = times.begin() + static_cast<std::ptrdiff_t>(times.size() / 2);
    std::nth_element(times.begin(), middle, times.end());
    return *middle;
}

Shaders::Shaders(const gl::Functions& gl, const std::string& beginning,
                 const std::vector<Stage>& stages)
    : gl_(gl), name_(gl.CreateProgram()) {
    for (const Stage& stage : stages) {
        const std::string text = "#version 450 core\n" + beginning + stage.text;
        const char* const begin = text.c_str();
        const GLuint shader = gl.CreateShader(stage.type);
        gl.ShaderSource(shader, 1, &begin, nullptr);
        gl.CompileShader(shader);
        gl.AttachShader(name_, shader);
        gl.DeleteShader(shader);
    }
    gl.LinkProgram(name_);
    GLint linked = 0;
    gl.GetProgramiv(name_, GL_LINK_STATUS, &linked);
    if (linked) return;
    std::string log(4096, '\0');
    GLsizei length = 0;
    gl.GetProgramInfoLog(name_, static_cast<GLsizei>(log.size()), &length, log.data());
    log.resize(static_cast<std::size_t>(length));
    gl.DeleteProgram(name_);
    throw std::runtime_error("a program does not link: " + log);
}

namespace {

Json measure(const Settings& settings) {
    const auto context = gl::createContext({.backend = "egl"});
    const gl::Functions& gl = context->functions();
    Json result;
    result["renderer"] = context->device().renderer;
    result["size"] = {settings.width, settings.height};
    result["threads"] = threadCount();
    result["counting"] = counting(gl, settings);
    result["sorting"] = sorting(gl, settings);
    return result;
}

}  // namespace
}  // namespace peeler::benchmark

int main(int count, char** arguments) {
    using namespace peeler::benchmark;
    Settings settings;
    int* const numbers[] = {&settings.width, &settings.height, &settings.runs};
    for (int i = 1; i < count && i <= static_cast<int>(std::size(numbers)); ++i)
        *numbers[i - 1] = std::max(1, std::atoi(arguments[i]));
    try {
        std::printf("%s\n", measure(settings).dump(1).c_str());
        return 0;
    } catch (const std::exception& error) {
        std::fprintf(stderr, "gpu_choices: %s\n", error.what());
        return 1;
    }
}
