// SPDX-License-Identifier: Apache-2.0
// The verb table, and the program's entry point.
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

/// A verb's action, called once its options have been parsed. Returns the exit code.
using VerbAction = std::function<int(Session&)>;

struct Verb {
    std::string_view name;
    std::string_view purpose;  ///< heading above the verb in `peeler --help`
    std::string_view summary;
    /// Three example commands for --help, one per line.
    std::string_view examples;
    /// The options that the short help lists, separated by spaces: "output size"; empty = all.
    std::string_view common;
    /// Declares the verb's options and returns the action, which owns the storage of the options.
    VerbAction (*declare)(VerbOptions&);
};

/// Returns all verbs, in the order of --help. The table is in cmd/verbs.cpp.
std::span<const Verb> verbs();

CommandDescription describeCommandLine();

/// Runs `peeler ARGUMENTS…`. Returns the exit code (cmd/README.md, "Exit codes"); does not throw.
int runCommandLine(const std::vector<std::string>& arguments, Console& console);

}  // namespace peeler::cmd
