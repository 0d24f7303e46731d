// SPDX-License-Identifier: Apache-2.0
// The table of verbs, and the way from arguments to a verb's action.
#pragma once

#include <functional>
#include <span>
#include <string>
#include <string_view>
#include <vector>

#include "cmd/cli/console.h"
#include "cmd/session/session.h"

namespace peeler::cmd {

class VerbOptions;
struct CommandDescription;

/// What a verb does once its options are read; the result is the exit code.
using VerbAction = std::function<int(Session&)>;

struct Verb {
    std::string_view name;
    std::string_view summary;  ///< one line for --help
    /// Three commands to begin with, a line each, which its --help shows.
    std::string_view examples;
    /// Declares the verb's options. The action owns what they are stored in.
    VerbAction (*declare)(VerbOptions&);
};

/// Every verb, in the order of --help. The table is in cmd/verbs.cpp.
std::span<const Verb> verbs();

/// What the program and all its verbs take: what --help is made of, for the manual.
CommandDescription describeCommandLine();

/// Runs `peeler ARGUMENTS…`. Returns the exit code (cmd/README.md, "Exit codes"); throws nothing.
int runCommandLine(const std::vector<std::string>& arguments, Console& console);

}  // namespace peeler::cmd
