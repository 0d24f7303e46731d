// SPDX-License-Identifier: Apache-2.0
#include "cmd/batch/parsed_verb.h"

#include "core/base/error.h"

namespace peeler::cmd {

ParsedVerb::ParsedVerb(const Verb& verb, const std::vector<std::string>& arguments)
    : options_(parser_.addVerb(std::string(verb.name), std::string(verb.summary))),
      action_(verb.declare(options_)) {
    std::vector<std::string> all{std::string(verb.name)};
    all.insert(all.end(), arguments.begin(), arguments.end());
    if (parser_.parse(all) != Asked::kVerb)
        throw Error(ErrorKind::kUsage, "there is nothing to do", "--help", "leave it out");
}

}  // namespace peeler::cmd
