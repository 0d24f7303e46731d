// SPDX-License-Identifier: Apache-2.0
// A GL backend, the row of the context table. The rows, context_egl.cpp and context_osmesa.cpp, are
// declared here.
#pragma once

#include <functional>
#include <memory>
#include <string>
#include <vector>

#include "core/gl/context.h"

namespace peeler::gl {

/// A place where a backend can make a context. `open` makes it current or says why not.
struct Candidate {
    Device device;  ///< backend, name and (if known beforehand) software; or the problem
    /// Returns null and a sentence in `problem` on failure. The context's functions are loaded.
    std::function<std::unique_ptr<Context>(std::string& problem)> open;
};

/// A row of the table.
struct Backend {
    const char* name;
    /// All candidates, hardware first. At least one, if only to say why there is none.
    std::vector<Candidate> (*candidates)();
};

std::vector<Candidate> eglCandidates();
std::vector<Candidate> osmesaCandidates();

}  // namespace peeler::gl
