// SPDX-License-Identifier: Apache-2.0
// Shader programs, built from the files of shaders/ (embedded at build time) and a list of
// definitions.
#pragma once

#include <span>
#include <string>
#include <string_view>
#include <vector>

#include "core/gl/functions.h"

namespace peeler::gl {

struct ShaderSource {
    std::string_view name;  ///< file name
    std::string_view text;
};

/// Returns the embedded shader files. shaders/embed.cmake generates the definition.
std::span<const ShaderSource> embeddedShaders();

/// Returns the text of a shader file with its `#include "x"` lines replaced by the named files
/// (with include guards). Reads a file from the folder in PEELER_SHADERS if the folder has it,
/// otherwise the embedded file. Throws Error (kInternal) if there is no such file.
std::string shaderText(std::string_view name);

class Program {
  public:
    Program() = default;
    explicit Program(const Functions& gl) : gl_(&gl), name_(gl.CreateProgram()) {}
    /// Compiles and links the files. Their extensions (".vert", ".frag", ".comp") give their
    /// stages. `definitions` ("NAME" or "NAME=value") become "#define" lines. Throws Error
    /// (kInternal) with the driver's log.
    Program(const Functions& gl, const std::vector<std::string_view>& files,
            const std::vector<std::string>& definitions);
    Program(Program&& other) noexcept;
    Program& operator=(Program&& other) noexcept;
    ~Program();

    void use() const;
    /// Sets the ivec4 uniform at an explicit location.
    void set(int location, int x, int y, int z, int w) const;

  private:
    const Functions* gl_ = nullptr;
    GLuint name_ = 0;
};

}  // namespace peeler::gl
