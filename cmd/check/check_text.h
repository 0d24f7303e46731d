// SPDX-License-Identifier: Apache-2.0
// Check reports as text and JSON.
#pragma once

#include <nlohmann/json_fwd.hpp>
#include <string>

#include "cmd/check/part_report.h"

namespace peeler::cmd {

/// Returns the verdict and its reasons as lines of text.
std::string toText(const CheckReport& report, const std::string& file);

/// Returns the verdict in one line, without the file's name.
std::string verdictText(const CheckReport& report);

/// Returns the report with the keys listed in cmd/README.md.
nlohmann::ordered_json toJson(const CheckReport& report);

}  // namespace peeler::cmd
