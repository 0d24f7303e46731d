// SPDX-License-Identifier: Apache-2.0
// JSON description of all verbs' options.
#pragma once

#include <string>

#include "cmd/cli/arguments.h"

namespace peeler::cmd {

/// Returns an object with `version` and `verbs`. `verbs` has an object by verb name, with `summary`
/// and `options`. Each option is an object with `names` (including dashes; empty for a positional
/// argument), `value` (name of the value; "" for a flag), `group`, `help`, `choices` (names), and,
/// only if true, `list`, `required`, `repeated` and `file`.
std::string describeAsJson(const CommandDescription& program);

}  // namespace peeler::cmd
