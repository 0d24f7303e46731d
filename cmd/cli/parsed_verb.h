// SPDX-License-Identifier: Apache-2.0
// A verb with parsed arguments, ready to run.
#pragma once

#include <string>
#include <vector>

#include "cmd/cli/arguments.h"
#include "cmd/cli/command_line.h"

namespace peeler::cmd {

/// Returns the verb with this name. Throws Error (kUsage), with the nearest name, if the name is
/// unknown.
const Verb& verbNamed(const std::string& name);

/// A verb whose arguments are parsed as on the command line.
class ParsedVerb {
  public:
    /// Declares the verb's options.
    explicit ParsedVerb(const Verb& verb);
    /// Declares the verb's options and calls parse().
    ParsedVerb(const Verb& verb, const std::vector<std::string>& arguments);
    ParsedVerb(const ParsedVerb&) = delete;
    ParsedVerb& operator=(const ParsedVerb&) = delete;

    /// Parses the arguments. Must be called only once. Throws Error (kUsage) if the arguments are
    /// malformed or contain --help. Does not access files.
    void parse(std::vector<std::string> arguments);

    const std::string& name() const { return name_; }
    /// Returns the verb's options. After parse(), VerbOptions::given() works.
    const VerbOptions& options() const { return options_; }

    /// Runs the verb. May be called only once. Returns the verb's exit code and passes on its
    /// exceptions.
    int run(Session& session) const { return action_(session); }

  private:
    std::string name_;
    ArgumentParser parser_;
    VerbOptions options_;
    VerbAction action_;  ///< owns the options' storage
};

}  // namespace peeler::cmd
