// SPDX-License-Identifier: Apache-2.0
// Parts shared by the files of gpu_choices: settings, timing, and compilation of its own shaders.
#pragma once

#include <cstddef>
#include <functional>
#include <nlohmann/json.hpp>
#include <string>
#include <vector>

#include "core/gl/functions.h"

namespace peeler::benchmark {

using Json = nlohmann::ordered_json;

struct Settings {
    int width = 1920, height = 1080, runs = 5;

    std::size_t pixels() const {
        return static_cast<std::size_t>(width) * static_cast<std::size_t>(height);
    }
};

/// Returns the median time of `work`, in milliseconds, over `runs` calls after an untimed call.
/// Calls `prepare` before each call.
double milliseconds(const Settings& settings, const std::function<void()>& prepare,
                    const std::function<void()>& work);

/// A program whose stages all begin with the same lines. Throws std::runtime_error with the
/// driver's log if compilation fails.
class Shaders {
  public:
    struct Stage {
        GLenum type;
        std::string text;
    };

    Shaders(const gl::Functions& gl, const std::string& beginning,
            const std::vector<Stage>& stages);
    Shaders(const Shaders&) = delete;
    Shaders& operator=(const Shaders&) = delete;
    ~Shaders() { gl_.DeleteProgram(name_); }

    void use() const { gl_.UseProgram(name_); }

  private:
    const gl::Functions& gl_;
    GLuint name_;
};

// The two halves of the benchmark. They throw std::runtime_error if two ways give different
// results.

/// Returns milliseconds by scene and way (gpu_counting.cpp); null if the driver does not support
/// the way.
Json counting(const gl::Functions& gl, const Settings& settings);

/// Returns milliseconds by kind of list and by step (gpu_sorting.cpp).
Json sorting(const gl::Functions& gl, const Settings& settings);

}  // namespace peeler::benchmark
