// SPDX-License-Identifier: Apache-2.0
// Loops over independent items on a fixed set of threads, and threads that leave signals to the
// main thread.
#pragma once

#include <cstddef>
#include <functional>
#include <thread>

namespace peeler {

/// Runs `work` on a thread of its own that takes no signals: it could hold any lock when their
/// handler runs. Throws std::system_error if a process limit allows no more threads.
std::thread startWorker(std::function<void()> work);

/// How many processors the process may run on, at least 1.
int affinityCount();

/// Sets how many threads parallelFor uses; 0 = as many as the process may run on. Call before the
/// first loop; the result of no loop depends on it.
void setThreadCount(int threads);
int threadCount();

/// Calls body(i) for every i in [0, items), in any order, on all threads, the caller's among them.
/// Returns when all are done. The first exception thrown by a body is rethrown here. Not to be
/// nested: a body that calls parallelFor runs that loop alone.
void parallelFor(std::size_t items, const std::function<void(std::size_t)>& body);

}  // namespace peeler
