// SPDX-License-Identifier: Apache-2.0
// JSON description of all verbs' options.
#pragma once

#include <string>

#include "cmd/cli/arguments.h"

namespace peeler::cmd {

/// Returns an object with `version` and `verbs`: objects by name, each with `summary` and
/// `options`: objects with `names` (with dashes; empty for a positional argument), `value` (its
/// name; "" for a flag), `group`, `help`, `choices` (names), and, only if true, `list`, `required`,
/// `repeated` and `file`.
std::string describeAsJson(const CommandDescription& program);

}  // namespace peeler::cmd
