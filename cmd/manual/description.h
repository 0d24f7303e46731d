// SPDX-License-Identifier: Apache-2.0
// The options of all verbs as JSON, for programs that call them.
#pragma once

#include <string>

#include "cmd/cli/arguments.h"

namespace peeler::cmd {

/// Returns an object with `version` and `verbs`: objects by name, each with `summary` and
/// `options`: objects with `names` (with dashes, none of an argument), `value` (what it is called;
/// "" of a flag), `group`, `help`, `choices` (names), and where they are true `list`, `required`,
/// `repeated` and `file`.
std::string describeAsJson(const CommandDescription& program);

}  // namespace peeler::cmd
