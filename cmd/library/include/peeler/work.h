// SPDX-License-Identifier: Apache-2.0
// Progress, cancellation and thread count.
#pragma once

#include <functional>

#pragma GCC visibility push(default)

namespace peeler::inline v0 {

/// Thrown by cancelled work. Not an Error: nothing went wrong.
struct Cancelled {};

/// A progress callback. Gets the share of work done, 0 to 1, never decreasing within a picture. An
/// exception it throws ends the work and is passed on.
using Progress = std::function<void(double)>;

/// Sets the number of threads for all work of this process; 0 = all available. No result depends on
/// it. Must not be called while work is running.
void setThreadCount(int threads);

}  // namespace peeler::inline v0

#pragma GCC visibility pop
