// SPDX-License-Identifier: Apache-2.0
// The report of a check as text and as JSON.
#pragma once

#include <nlohmann/json_fwd.hpp>
#include <string>

#include "cmd/check/part_report.h"

namespace peeler::cmd {

/// The verdict, and why, as lines of text.
std::string toText(const CheckReport& report, const std::string& file);

/// What the verdict is, in one line without the file's name.
std::string verdictText(const CheckReport& report);

/// The keys that cmd/README.md lists.
nlohmann::ordered_json toJson(const CheckReport& report);

}  // namespace peeler::cmd
