// SPDX-License-Identifier: Apache-2.0
// Progress, cancellation and threads of work.
#pragma once

#include <functional>

#pragma GCC visibility push(default)

namespace peeler::inline v0 {

/// Thrown through work that was cancelled. Not an Error: nothing went wrong, and the rest is not to
/// be done.
struct Cancelled {};

/// Called with the share of the work that is done, 0 to 1, never falling within a picture. An
/// exception that it throws ends the work and is passed on.
using Progress = std::function<void(double)>;

/// Sets how many threads all work of this process uses together; 0 = as many as it may run on. No
/// result depends on it. Not while there is work being done.
void setThreadCount(int threads);

}  // namespace peeler::inline v0

#pragma GCC visibility pop
