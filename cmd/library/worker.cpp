// SPDX-License-Identifier: Apache-2.0
#include "cmd/library/worker.h"

#include <algorithm>
#include <chrono>
#include <utility>

#include "core/base/parallel.h"

namespace peeler {
namespace {

/// The interval between calls of a progress function.
constexpr std::chrono::milliseconds kBetween{30};

/// Thrown inside a cancelled job, to end the job. run() rethrows the exception of the progress
/// function instead.
struct GivenUp {};

}  // namespace

Worker::Worker(bool own_thread) {
    if (own_thread) thread_ = startWorker([this] { serve(); });
}

Worker::~Worker() {
    if (!thread_) return;
    {
        const std::lock_guard lock(mutex_);
        end_ = true;
    }
    changed_.notify_all();
    thread_->join();
}

void Worker::run(const Work& work, const Progress& progress) {
    const std::lock_guard alone(one_at_a_time_);
    if (!thread_) {
        work(progress ? progress : [](double) {});
        return;
    }
    std::unique_lock lock(mutex_);
    work_ = &work;
    share_ = 0;
    given_up_ = false;
    failure_ = nullptr;
    changed_.notify_all();
    const auto done = [this] { return work_ == nullptr; };
    std::exception_ptr thrown;
    while (!done()) {
        if (!progress || thrown) {
            changed_.wait(lock, done);
            break;
        }
        if (changed_.wait_for(lock, kBetween, done)) break;
        const double share = share_;
        lock.unlock();
        try {
            progress(share);
        } catch (...) {
            thrown = std::current_exception();
        }
        lock.lock();
        given_up_ = thrown != nullptr;
    }
    const std::exception_ptr failure = std::exchange(failure_, nullptr);
    lock.unlock();
    if (thrown) std::rethrow_exception(thrown);
    if (failure) std::rethrow_exception(failure);
    if (progress) progress(1);
}

void Worker::serve() {
    const Progress report = [this](double share) {
        const std::lock_guard lock(mutex_);
        share_ = std::max(share_, share);
        if (given_up_) throw GivenUp();
    };
    std::unique_lock lock(mutex_);
    for (;;) {
        changed_.wait(lock, [this] { return end_ || work_; });
        if (end_) return;
        const Work* const work = work_;
        lock.unlock();
        std::exception_ptr failure;
        try {
            (*work)(report);
        } catch (...) {
            failure = std::current_exception();
        }
        lock.lock();
        failure_ = std::move(failure);
        work_ = nullptr;
        changed_.notify_all();
    }
}

}  // namespace peeler
