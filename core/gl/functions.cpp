// SPDX-License-Identifier: Apache-2.0
#include "core/gl/functions.h"

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

}  // namespace peeler::gl
