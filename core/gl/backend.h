// SPDX-License-Identifier: Apache-2.0
// GL backends: the row type of the context table, and its rows, context_egl.cpp and
// context_osmesa.cpp.
#pragma once

#include <functional>
#include <memory>
#include <string>
#include <vector>

#include "core/gl/context.h"

namespace peeler::gl {

/// A possible context of a backend. `open` makes it current or explains why it cannot.
struct Candidate {
    Device device;  ///< backend, name and (if known beforehand) software; or the problem
    /// Returns null and a sentence in `problem` on failure. The context's functions are loaded.
    std::function<std::unique_ptr<Context>(std::string& problem)> open;
};

/// A row of the backend table.
struct Backend {
    const char* name;
    /// Returns all candidates, hardware first; at least one, if only to explain why there is none.
    std::vector<Candidate> (*candidates)();
};

std::vector<Candidate> eglCandidates();
std::vector<Candidate> osmesaCandidates();

}  // namespace peeler::gl
