// SPDX-License-Identifier: Apache-2.0
// GL backends: the row type of the backend table, and the functions in its rows (context_egl.cpp,
// context_osmesa.cpp).
#pragma once

#include <functional>
#include <memory>
#include <string>
#include <vector>

#include "core/gl/context.h"

namespace peeler::gl {

/// A context that a backend may be able to open.
struct Candidate {
    Device device;  ///< with backend, name and, if known, `software`; or with the problem
    /// Opens the context, makes it current and loads its functions. On failure, returns null and
    /// sets `problem` to a sentence.
    std::function<std::unique_ptr<Context>(std::string& problem)> open;
};

/// A row of the backend table.
struct Backend {
    const char* name;
    /// Returns all candidates, hardware first. If the backend has no devices, returns one candidate
    /// with the reason in Device::problem.
    std::vector<Candidate> (*candidates)();
};

std::vector<Candidate> eglCandidates();
std::vector<Candidate> osmesaCandidates();

}  // namespace peeler::gl
