// SPDX-License-Identifier: Apache-2.0
// Parallel loops on a fixed set of threads, per-thread objects, and threads that leave signals to
// the main thread.
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

/// The hint of an Error that is thrown because threads cannot be started.
inline constexpr char kMoreThreads[] =
    "raise the limit on processes and threads (ulimit -u, a cgroup's pids.max), or end other "
    "processes";

/// Runs `work` on a new thread with all signals blocked, because a signal handler could run while
/// the thread holds a lock. Throws Error (kMemory) if a process limit allows no more threads.
std::thread startWorker(std::function<void()> work);

/// Returns how many more threads, at most `wanted`, can be started. Starts and ends threads to find
/// out, since limits (RLIMIT_NPROC, a cgroup's pids.max) also count the threads of other processes.
int startableThreads(int wanted);

/// Returns the number of processors the process may run on, at least 1.
int affinityCount();

/// Returns the number of threads that parallelFor uses (setThreadCount).
int threadCount();

/// Calls body(i) for every i in [0, items), in any order, on all threads including the caller's.
/// Returns when all are done. Rethrows the first exception thrown by a body. Nesting gains nothing:
/// if a body calls parallelFor, the inner loop runs on the body's thread alone. Loops of several
/// callers share the other threads. A child of fork() starts threads of its own; a body must not
/// fork and continue in the child.
void parallelFor(std::size_t items, const std::function<void(std::size_t)>& body);

/// A pool of objects: lends one to each thread and reuses those that are returned.
template <class Item>
class ObjectPool {
  public:
    /// Calls use(item) with an item that no other thread uses meanwhile.
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
