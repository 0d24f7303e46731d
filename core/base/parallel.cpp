// SPDX-License-Identifier: Apache-2.0
// A persistent pool of threads behind parallelFor.
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

/// A new thread inherits the mask of the one that starts it.
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

/// Grows by one with each thread of the process; 0 without /proc.
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
        throw Error(ErrorKind::kMemory, "no thread can be started", "", kMoreThreads);
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
            // So many, then.
        }
    }
    for (std::thread& thread : started)
        thread.join();
    // One that has been joined is counted until the kernel has taken it away.
    for (int i = 0; i < 100 && taskLinks() > before; ++i)
        std::this_thread::sleep_for(std::chrono::microseconds(100));
    return static_cast<int>(started.size());
}

namespace {

thread_local bool inside_loop = false;

/// One loop at a time: the caller publishes it, everybody takes items until none is left.
class Pool {
  public:
    explicit Pool(int threads) {
        try {
            for (int i = 1; i < threads; ++i)
                workers_.push_back(startWorker([this] { work(); }));
        } catch (...) {
            // Fewer threads than asked for (a process limit) is slower, not wrong.
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
        {
            const std::lock_guard lock(mutex_);
            body_ = &body;
            items_ = items;
            next_ = 0;
            failure_ = nullptr;
            busy_ = workers_.size();
            ++loop_;
        }
        wake_.notify_all();
        takeItems();
        std::unique_lock lock(mutex_);
        idle_.wait(lock, [this] { return busy_ == 0; });
        if (failure_) std::rethrow_exception(std::exchange(failure_, nullptr));
    }

  private:
    void work() {
        std::uint64_t seen = 0;
        while (true) {
            {
                std::unique_lock lock(mutex_);
                wake_.wait(lock, [&] { return stop_ || loop_ != seen; });
                if (stop_) return;
                seen = loop_;
            }
            takeItems();
            const std::lock_guard lock(mutex_);
            if (--busy_ == 0) idle_.notify_one();
        }
    }

    void takeItems() {
        inside_loop = true;
        try {
            for (std::size_t i; (i = next_.fetch_add(1)) < items_;)
                (*body_)(i);
        } catch (...) {
            next_ = items_;  // what has not begun need not begin
            const std::lock_guard lock(mutex_);
            if (!failure_) failure_ = std::current_exception();
        }
        inside_loop = false;
    }

    std::vector<std::thread> workers_;
    std::mutex mutex_;
    std::condition_variable wake_, idle_;
    const std::function<void(std::size_t)>* body_ = nullptr;
    std::size_t items_ = 0;
    std::atomic<std::size_t> next_{0};
    std::size_t busy_ = 0;  ///< workers that have not finished the current loop
    std::uint64_t loop_ = 0;
    std::exception_ptr failure_;
    bool stop_ = false;
};

std::atomic<int> wanted_threads{0};
std::mutex pool_mutex;  ///< held for the length of a loop
std::unique_ptr<Pool> pool;
int pool_threads = 0;

/// A child that a host forks has the pool without its threads, and the lock as it was at that
/// moment, perhaps held by a thread that the child does not have. Both are left behind: to end the
/// pool would be to wait for its threads.
void forgetPool() {
    new (&pool_mutex) std::mutex;
    static_cast<void>(pool.release());
    pool_threads = 0;
}

std::unique_ptr<Pool> makePool(int threads) {
    static const int watches_forks = pthread_atfork(nullptr, nullptr, forgetPool);
    static_cast<void>(watches_forks);
    return std::make_unique<Pool>(threads);
}

}  // namespace

int affinityCount() {
    // The affinity mask, not the number of processors: schedulers of render farms pin processes.
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
    std::unique_lock lock(pool_mutex, std::defer_lock);
    // A nested loop, and one that a second thread starts meanwhile, runs on its caller alone.
    if (items > 1 && !inside_loop && lock.try_lock()) {
        const int threads = threadCount();
        if (threads > 1) {
            if (!pool || pool_threads != threads) {
                pool.reset();
                pool = makePool(threads);
                pool_threads = threads;
            }
            pool->run(items, body);
            return;
        }
    }
    for (std::size_t i = 0; i < items; ++i)
        body(i);
}

}  // namespace peeler
