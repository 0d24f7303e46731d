// SPDX-License-Identifier: Apache-2.0
// Progress, cancellation and thread count.
#pragma once

#include <functional>

#pragma GCC visibility push(default)

namespace peeler::inline v0 {

/// Thrown by cancelled work. Not an Error, because nothing went wrong.
struct Cancelled {};

/// A progress callback. Its argument is the share of work done, 0 to 1, which never decreases
/// within a picture. An exception from the callback ends the work and is passed on to the caller.
using Progress = std::function<void(double)>;

/// Sets the number of threads for all work of this process; 0 = all available. Results do not
/// depend on the thread count. Must not be called while work is running.
void setThreadCount(int threads);

}  // namespace peeler::inline v0

#pragma GCC visibility pop
