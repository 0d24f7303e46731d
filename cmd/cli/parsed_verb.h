// SPDX-License-Identifier: Apache-2.0
// A verb whose arguments have been read, and that can be run.
#pragma once

#include <string>
#include <vector>

#include "cmd/cli/arguments.h"
#include "cmd/cli/command_line.h"

namespace peeler::cmd {

/// The row of the table with this name. Throws Error (kUsage) for an unknown one, with the nearest.
const Verb& verbNamed(const std::string& name);

/// The arguments of a verb, read as the command line reads them.
class ParsedVerb {
  public:
    /// Declares the verb's options.
    explicit ParsedVerb(const Verb& verb);
    /// The same, and parse().
    ParsedVerb(const Verb& verb, const std::vector<std::string>& arguments);
    ParsedVerb(const ParsedVerb&) = delete;
    ParsedVerb& operator=(const ParsedVerb&) = delete;

    /// To be called once. Throws Error (kUsage) for arguments that the verb would refuse for their
    /// form, and for --help: there is nothing to carry out. Files are not looked at.
    void parse(std::vector<std::string> arguments);

    const std::string& name() const { return name_; }
    /// The options that the verb has, and, once they are parsed, which of them are given.
    const VerbOptions& options() const { return options_; }

    /// Does what the verb does, once. Returns its exit code; throws what it throws.
    int run(Session& session) const { return action_(session); }

  private:
    std::string name_;
    ArgumentParser parser_;
    VerbOptions options_;
    VerbAction action_;  ///< owns what the options are stored in
};

}  // namespace peeler::cmd
