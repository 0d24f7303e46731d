// SPDX-License-Identifier: Apache-2.0
// Names of peeling methods, as test parameters.
#pragma once

#include <string>
#include <vector>

#include "core/capture/method.h"

namespace peeler::test {

/// Returns the names of all exact methods, or of all other methods.
inline std::vector<std::string> methodNames(bool exact) {
    std::vector<std::string> names;
    for (const auto& method : peelMethods())
        if (method.exact() == exact) names.emplace_back(method.name);
    return names;
}

}  // namespace peeler::test
