// SPDX-License-Identifier: Apache-2.0
// The persistent thread pool of parallelFor.
#include "core/base/parallel.h"

#include <pthread.h>
#include <sched.h>
#include <signal.h>
#include <sys/stat.h>
#include <algorithm>
#include <atomic>
#include <chrono>
#include <condition_variable>
#include <cstdint>
#include <exception>
#include <memory>
#include <mutex>
#include <new>
#include <system_error>
#include <thread>
#include <utility>
#include <vector>

#include <peeler/error.h>

namespace peeler {
namespace {

/// A scope in which all signals are blocked on this thread. Threads that are started in the scope
/// also have them blocked.
class SignalsBlocked {
  public:
    SignalsBlocked() {
        sigset_t all;
        sigfillset(&all);
        pthread_sigmask(SIG_SETMASK, &all, &before_);
    }
    ~SignalsBlocked() { pthread_sigmask(SIG_SETMASK, &before_, nullptr); }
    SignalsBlocked(const SignalsBlocked&) = delete;
    SignalsBlocked& operator=(const SignalsBlocked&) = delete;

  private:
    sigset_t before_;
};

/// Returns the link count of /proc/self/task, which grows by one with each thread of the process; 0
/// if there is no /proc.
nlink_t taskLinks() {
    struct stat status {};
    return ::stat("/proc/self/task", &status) == 0 ? status.st_nlink : 0;
}

}  // namespace

std::thread startWorker(std::function<void()> work) {
    const SignalsBlocked blocked;
    try {
        return std::thread(std::move(work));
    } catch (const std::system_error&) {
        throw Error(ErrorKind::kMemory, "cannot start a thread", "", kMoreThreads);
    }
}

int startableThreads(int wanted) {
    const auto before = taskLinks();
    std::vector<std::thread> started;
    started.reserve(static_cast<std::size_t>(wanted));
    std::mutex gate;
    {
        const std::lock_guard closed(gate);
        try {
            while (started.size() < static_cast<std::size_t>(wanted))
                started.push_back(startWorker([&] { const std::lock_guard passed(gate); }));
        } catch (...) {
            // The system cannot start more threads.
        }
    }
    for (std::thread& thread : started)
        thread.join();
    // The kernel counts a joined thread until it removes the thread, which may be some time after
    // the join.
    for (int i = 0; i < 100 && taskLinks() > before; ++i)
        std::this_thread::sleep_for(std::chrono::microseconds(100));
    return static_cast<int>(started.size());
}

namespace {

thread_local bool inside_loop = false;

/// One parallelFor loop. Threads take items until none are left.
struct Loop {
    const std::function<void(std::size_t)>& body;
    std::size_t items;
    std::atomic<std::size_t> next{0};
    std::size_t workers = 0;  ///< threads helping the caller; guarded by the pool's mutex
    std::exception_ptr failure{};

    bool hasItems() const { return next < items; }
};

/// A pool of threads that help the callers of loops. Concurrent loops share the threads evenly.
class Pool {
  public:
    explicit Pool(int threads) {
        try {
            for (int i = 1; i < threads; ++i)
                workers_.push_back(startWorker([this] { work(); }));
        } catch (...) {
            // A process limit may allow fewer threads. The loops are then slower but correct.
        }
    }

    ~Pool() {
        {
            const std::lock_guard lock(mutex_);
            stop_ = true;
        }
        wake_.notify_all();
        for (auto& worker : workers_)
            worker.join();
    }

    Pool(const Pool&) = delete;
    Pool& operator=(const Pool&) = delete;

    void run(std::size_t items, const std::function<void(std::size_t)>& body) {
        Loop loop{.body = body, .items = items};
        {
            const std::lock_guard lock(mutex_);
            loops_.push_back(&loop);
            ++changes_;
        }
        wake_.notify_all();
        while (loop.hasItems())
            takeItems(loop);
        std::unique_lock lock(mutex_);
        std::erase(loops_, &loop);
        idle_.wait(lock, [&] { return loop.workers == 0; });
        if (loop.failure) std::rethrow_exception(loop.failure);
    }

  private:
    void work() {
        std::unique_lock lock(mutex_);
        while (true) {
            Loop* loop = nullptr;
            wake_.wait(lock, [&] {
                loop = neediest();
                return stop_ || loop;
            });
            if (stop_) return;
            ++loop->workers;
            lock.unlock();
            takeItems(*loop);
            lock.lock();
            if (--loop->workers == 0) idle_.notify_all();
        }
    }

    /// Returns the loop with the fewest workers among the loops that have items left; null if no
    /// loop has items left.
    Loop* neediest() const {
        Loop* found = nullptr;
        for (Loop* loop : loops_) {
            if (loop->hasItems() && (!found || loop->workers < found->workers)) found = loop;
        }
        return found;
    }

    /// Runs items of the loop until no items are left, or until another loop starts and may need
    /// this thread.
    void takeItems(Loop& loop) {
        const std::uint64_t changes = changes_;
        inside_loop = true;
        try {
            for (std::size_t i; changes == changes_ && (i = loop.next.fetch_add(1)) < loop.items;)
                loop.body(i);
        } catch (...) {
            loop.next = loop.items;  // do not start the remaining items
            const std::lock_guard lock(mutex_);
            if (!loop.failure) loop.failure = std::current_exception();
        }
        inside_loop = false;
    }

    std::vector<std::thread> workers_;
    std::mutex mutex_;
    std::condition_variable wake_, idle_;
    std::vector<Loop*> loops_;               ///< loops whose callers are in run()
    std::atomic<std::uint64_t> changes_{0};  ///< number of loops started
    bool stop_ = false;
};

std::atomic<int> wanted_threads{0};
std::mutex pool_mutex;  ///< guards `pool` and `pool_threads`
std::shared_ptr<Pool> pool;
int pool_threads = 0;

/// Abandons the pool and its mutex in a child process forked by a host. The child has no copy of
/// the pool's threads, and one of them may have held the mutex during the fork. Leaks the pool and
/// the mutex, because the pool's destructor would wait for its threads.
void forgetPool() {
    new (&pool_mutex) std::mutex;
    new (&pool) std::shared_ptr<Pool>;
    pool_threads = 0;
}

/// Returns a pool of `threads` threads, including the caller's. Replaces a pool of another size;
/// the old pool is destroyed when its last loop ends.
std::shared_ptr<Pool> poolOf(int threads) {
    static const int watches_forks = pthread_atfork(nullptr, nullptr, forgetPool);
    static_cast<void>(watches_forks);
    const std::lock_guard lock(pool_mutex);
    if (!pool || pool_threads != threads) {
        pool.reset();
        pool = std::make_shared<Pool>(threads);
        pool_threads = threads;
    }
    return pool;
}

}  // namespace

int affinityCount() {
    // Counts the processors of the affinity mask instead of all processors, because render-farm
    // schedulers pin processes.
    cpu_set_t set;
    CPU_ZERO(&set);
    const int count = sched_getaffinity(0, sizeof set, &set) == 0
                          ? CPU_COUNT(&set)
                          : static_cast<int>(std::thread::hardware_concurrency());
    return std::max(1, count);
}

inline namespace v0 {
void setThreadCount(int threads) {
    wanted_threads = std::max(0, threads);
}
}  // namespace v0

int threadCount() {
    const int wanted = wanted_threads;
    return wanted > 0 ? wanted : affinityCount();
}

void parallelFor(std::size_t items, const std::function<void(std::size_t)>& body) {
    const int threads = threadCount();
    if (items > 1 && threads > 1 && !inside_loop) return poolOf(threads)->run(items, body);
    for (std::size_t i = 0; i < items; ++i)
        body(i);
}

}  // namespace peeler
