// SPDX-License-Identifier: Apache-2.0
// Stage timings.
#pragma once

#include <map>
#include <string>

#pragma GCC visibility push(default)

namespace peeler::inline v0 {

/// Milliseconds by stage ("upload", "count", "capture", "sort", "composite", "encode", "write", …).
using StageTimes = std::map<std::string, double>;

}  // namespace peeler::inline v0

#pragma GCC visibility pop
