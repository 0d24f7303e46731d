// SPDX-License-Identifier: Apache-2.0
#include "cmd/cli/parsed_verb.h"

#include <string_view>

#include <peeler/error.h>
#include "cmd/session/choices.h"

namespace peeler::cmd {

const Verb& verbNamed(const std::string& name) {
    std::vector<std::string_view> names;
    for (const Verb& verb : verbs()) {
        if (verb.name == name) return verb;
        names.push_back(verb.name);
    }
    refuseName("verb", name, names);
}

ParsedVerb::ParsedVerb(const Verb& verb)
    : name_(verb.name),
      options_(parser_.addVerb(name_, {.summary = verb.summary})),
      action_(verb.declare(options_)) {}

ParsedVerb::ParsedVerb(const Verb& verb, const std::vector<std::string>& arguments)
    : ParsedVerb(verb) {
    parse(arguments);
}

void ParsedVerb::parse(std::vector<std::string> arguments) {
    arguments.insert(arguments.begin(), name_);
    if (parser_.parse(arguments) != Asked::kVerb)
        throw Error(ErrorKind::kUsage, "a job cannot print help", "--help", "leave it out");
}

}  // namespace peeler::cmd
