// SPDX-License-Identifier: Apache-2.0
// Parallel loops on a fixed set of threads, per-thread objects, and threads with signals blocked.
#pragma once

#include <cstddef>
#include <functional>
#include <memory>
#include <mutex>
#include <thread>
#include <utility>
#include <vector>

#include <peeler/work.h>

namespace peeler {

/// The hint of an Error about threads that cannot be started.
inline constexpr char kMoreThreads[] =
    "raise the limit on processes and threads (ulimit -u, a cgroup's pids.max), or end other "
    "processes";

/// Runs `work` on a new thread with all signals blocked, so that no signal handler interrupts a
/// thread that holds a lock. Throws Error (kMemory) if a process limit allows no more threads.
std::thread startWorker(std::function<void()> work);

/// Returns the number of additional threads, at most `wanted`, that can be started. Finds out by
/// starting and ending threads, since limits (RLIMIT_NPROC, a cgroup's pids.max) also count threads
/// of other processes.
int startableThreads(int wanted);

/// Returns the number of processors that the process may run on, at least 1.
int affinityCount();

/// Returns the number of threads that parallelFor uses (setThreadCount).
int threadCount();

/// Calls body(i) for every i in [0, items), in any order, on all threads including the caller's.
/// Returns when all calls are done. Rethrows the first exception that a body throws. A parallelFor
/// inside a body runs only on the body's thread. Loops of several callers share the other threads.
/// A child of fork() starts its own threads; a body must not fork and continue in the child.
void parallelFor(std::size_t items, const std::function<void(std::size_t)>& body);

/// A pool of objects. Lends one to each thread and reuses returned objects.
template <class Item>
class ObjectPool {
  public:
    /// Calls use(item) with an item that no other thread uses during the call.
    template <class Use>
    void with(Use&& use) {
        std::unique_ptr<Item> item;
        {
            const std::lock_guard lock(mutex_);
            if (!items_.empty()) {
                item = std::move(items_.back());
                items_.pop_back();
            }
        }
        if (!item) item = std::make_unique<Item>();
        use(*item);
        const std::lock_guard lock(mutex_);
        items_.push_back(std::move(item));
    }
    void free() { items_.clear(); }

  private:
    std::mutex mutex_;
    std::vector<std::unique_ptr<Item>> items_;
};

}  // namespace peeler
