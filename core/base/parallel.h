// SPDX-License-Identifier: Apache-2.0
// Loops over independent items on a fixed set of threads, what each of them needs one of, and
// threads that leave signals to the main thread.
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

/// The hint of an Error where threads cannot be started.
inline constexpr char kMoreThreads[] =
    "raise the limit of processes and threads (ulimit -u, a cgroup's pids.max), or end others";

/// Runs `work` on a thread of its own that takes no signals: it could hold any lock when their
/// handler runs. Throws Error (kMemory) if a process limit allows no more threads.
std::thread startWorker(std::function<void()> work);

/// Returns how many threads, at most `wanted`, can be started beside those that there are. It
/// starts and ends so many: limits (RLIMIT_NPROC, a cgroup's pids.max) say only what they count
/// with others.
int startableThreads(int wanted);

/// How many processors the process may run on, at least 1.
int affinityCount();

/// How many threads parallelFor uses (setThreadCount).
int threadCount();

/// Calls body(i) for every i in [0, items), in any order, on all threads, the caller's among them.
/// Returns when all are done. The first exception thrown by a body is rethrown here. Not to be
/// nested: a body that calls parallelFor runs that loop alone. Loops of several threads at a time
/// share the others. A child of fork() has threads of its own; a body must not fork and go on.
void parallelFor(std::size_t items, const std::function<void(std::size_t)>& body);

/// Hands out one item to each thread at work, and keeps them for those that come next.
template <class Item>
class ObjectPool {
  public:
    /// Calls use(item) with one that no other thread has meanwhile.
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
