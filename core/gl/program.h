// SPDX-License-Identifier: Apache-2.0
// Programs, assembled from the files of shaders/ and a list of definitions.
#pragma once

#include <string>
#include <string_view>
#include <vector>

#include "core/gl/functions.h"

namespace peeler::gl {

class Program {
  public:
    Program() = default;
    explicit Program(const Functions& gl) : gl_(&gl), name_(gl.CreateProgram()) {}
    /// Compiles and links the files (".vert", ".frag", ".comp" by extension) with "#define X" lines
    /// for `definitions` ("NAME" or "NAME value"). Throws Error (kInternal) with the driver's log.
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
