// SPDX-License-Identifier: Apache-2.0
// Threads that leave signals to the main thread.
#pragma once

#include <functional>
#include <thread>

namespace peeler {

/// Runs `work` on a thread of its own that takes no signals: it could hold any lock when their
/// handler runs. Throws std::system_error if a process limit allows no more threads.
std::thread startWorker(std::function<void()> work);

}  // namespace peeler
