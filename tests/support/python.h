// SPDX-License-Identifier: Apache-2.0
// Debian's Python and its packages: independent readers of our files.
#pragma once

#include <filesystem>
#include <string>
#include <vector>

#include "support/test_support.h"

namespace peeler::test {

/// Returns Debian's interpreter, which finds Debian's packages, even if PATH has another one first.
inline std::string python() {
    return std::filesystem::exists("/usr/bin/python3") ? "/usr/bin/python3" : "python3";
}

inline bool pythonHas(const std::string& module) {
    return runCommand({python(), "-c", "import " + module}).exit_code == 0;
}

/// Runs a Python program, given as text. `arguments` become its sys.argv[1:].
inline CommandResult runPython(const std::string& program,
                               const std::vector<std::string>& arguments) {
    std::vector<std::string> command{python(), "-c", program};
    command.insert(command.end(), arguments.begin(), arguments.end());
    return runCommand(command);
}

}  // namespace peeler::test

#define PEELER_REQUIRE_PYTHON(module)                               \
    if (!peeler::test::pythonHas(module)) {                         \
        GTEST_SKIP() << "Python has no module " << module           \
                     << " (examples/install_dependencies.sh test)"; \
    }
