// SPDX-License-Identifier: Apache-2.0
// From arguments to a verb's action.
#pragma once

#include <string>
#include <vector>

#include "cmd/cli/console.h"

namespace peeler::cmd {

/// Runs `peeler ARGUMENTS…`. Returns the exit code (cmd/README.md, "Exit codes"); throws
/// nothing.
int runCommandLine(const std::vector<std::string>& arguments, Console& console);

}  // namespace peeler::cmd
