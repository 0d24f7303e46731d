// SPDX-License-Identifier: Apache-2.0
// A verb's arguments, read as the command line reads them and not carried out.
#pragma once

#include <string>
#include <vector>

#include "cmd/cli/options.h"
#include "cmd/verbs.h"

namespace peeler::cmd {

class ParsedVerb {
  public:
    /// Throws Error (kUsage) for arguments that the verb would refuse for their form, and for
    /// --help: there is nothing to carry out. Files are not looked at.
    ParsedVerb(const Verb& verb, const std::vector<std::string>& arguments);

    /// Which options the verb has, and what is given.
    const VerbOptions& options() const { return options_; }

  private:
    ArgumentParser parser_;
    VerbOptions options_;
    VerbAction action_;  ///< owns where the values are stored
};

}  // namespace peeler::cmd
