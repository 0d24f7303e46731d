// SPDX-License-Identifier: Apache-2.0
// Shell completions, from the same descriptions as --help.
#pragma once

#include <string>

#include "cmd/cli/arguments.h"

namespace peeler::cmd {

// Return the completion file for a shell.
std::string bashCompletions(const CommandDescription& program);

std::string zshCompletions(const CommandDescription& program);

std::string fishCompletions(const CommandDescription& program);

}  // namespace peeler::cmd
