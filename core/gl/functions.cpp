// SPDX-License-Identifier: Apache-2.0
#include "core/gl/functions.h"

#include "core/gl/barrier_check.h"

namespace peeler::gl {

std::string loadFunctions(Functions& functions, const ProcAddress& lookup) {
#define X(stem, name)                                                         \
    functions.name = reinterpret_cast<PFNGL##stem##PROC>(lookup("gl" #name)); \
    if (!functions.name) return "gl" #name;
    PEELER_GL_FUNCTIONS(X)
#undef X
    checkBarriers(functions, lookup);
    return {};
}

bool hasExtension(const Functions& functions, std::string_view name) {
    GLint count = 0;
    functions.GetIntegerv(GL_NUM_EXTENSIONS, &count);
    for (GLint i = 0; i < count; ++i) {
        const GLubyte* const one = functions.GetStringi(GL_EXTENSIONS, static_cast<GLuint>(i));
        if (one && reinterpret_cast<const char*>(one) == name) return true;
    }
    return false;
}

}  // namespace peeler::gl
