// SPDX-License-Identifier: Apache-2.0
// Completions of shells, a file each, made of what --help is made of.
#pragma once

#include <string>

#include "cmd/cli/arguments.h"

namespace peeler::cmd {

// Completions, a file of a shell each.
std::string bashCompletions(const CommandDescription& program);

std::string zshCompletions(const CommandDescription& program);

std::string fishCompletions(const CommandDescription& program);

}  // namespace peeler::cmd
