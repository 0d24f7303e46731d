// SPDX-License-Identifier: Apache-2.0
// Manual pages, from the same descriptions as --help. All functions are pure.
#pragma once

#include <span>
#include <string>
#include <string_view>
#include <vector>

#include "cmd/cli/arguments.h"

namespace peeler::cmd {

/// An environment variable that peeler reads, for the manual.
struct EnvironmentVariable {
    std::string_view names;  ///< separated by commas
    std::string_view meaning;
};
std::span<const EnvironmentVariable> environmentVariables();

/// Returns the name of a manual page: "peeler" or "peeler-VERB".
std::string pageName(const CommandDescription& program, const CommandDescription& command);

/// Returns the man(7) page for a verb or for the program; `date` may be empty.
std::string manualPage(const CommandDescription& program, const CommandDescription& command,
                       const std::string& date);

/// Returns `text` escaped for roff, including a control character at the start.
std::string roffText(std::string_view text);

/// Returns the literal values that an option accepts: its choices, or the lower-case alternatives
/// in a value name such as "N|all".
std::vector<ChoiceDescription> valuesOf(const OptionDescription& option);

}  // namespace peeler::cmd
