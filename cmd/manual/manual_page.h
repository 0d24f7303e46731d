// SPDX-License-Identifier: Apache-2.0
// The manual and the completions of shells, made of what --help is made of. All functions are pure.
#pragma once

#include <span>
#include <string>
#include <string_view>
#include <vector>

#include "cmd/cli/arguments.h"

namespace peeler::cmd {

/// A variable that peeler reads, for the manual.
struct EnvironmentVariable {
    std::string_view names;  ///< with commas between
    std::string_view meaning;
};
std::span<const EnvironmentVariable> environmentVariables();

/// "peeler", or "peeler-VERB": what a page is called.
std::string pageName(const CommandDescription& program, const CommandDescription& command);

/// A page in roff for man(7), of a verb or of the program itself; `date` may be empty.
std::string manualPage(const CommandDescription& program, const CommandDescription& command,
                       const std::string& date);

/// `text` as roff shows it, whatever it begins with.
std::string roffText(std::string_view text);

/// What may stand for the value of an option: its choices, and of "N|all" what is in lower case.
std::vector<ChoiceDescription> valuesOf(const OptionDescription& option);

}  // namespace peeler::cmd
