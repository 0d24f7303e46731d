// SPDX-License-Identifier: Apache-2.0
// A verb's arguments, read as the command line reads them and not carried out.
#pragma once

#include <memory>
#include <string>
#include <vector>

#include "cmd/verbs.h"

namespace peeler::cmd {

/// Parses, CLI11's errors as ours: Error (kUsage). Requests for help and for the version are thrown
/// as CLI11 has them.
void parseArguments(CLI::App& app, const std::vector<std::string>& arguments);

class ParsedVerb {
  public:
    /// Throws Error (kUsage) for arguments that the verb would refuse for their form, and for
    /// --help: there is nothing to carry out. Files are not looked at.
    ParsedVerb(const Verb& verb, const std::vector<std::string>& arguments);
    ~ParsedVerb();
    ParsedVerb(const ParsedVerb&) = delete;
    ParsedVerb& operator=(const ParsedVerb&) = delete;

    /// Whether the verb has such an option ("--memory").
    bool knows(const std::string& option) const;
    /// Whether it is given.
    bool has(const std::string& option) const;
    /// Its value, the last one if it is given several times; "" if it is not given.
    std::string value(const std::string& option) const;

  private:
    std::unique_ptr<CLI::App> app_;
    VerbAction action_;  ///< owns where the values are stored
};

}  // namespace peeler::cmd
