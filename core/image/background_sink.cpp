// SPDX-License-Identifier: Apache-2.0
#include "core/image/background_sink.h"

#include <utility>

#include <peeler/error.h>
#include "core/base/parallel.h"

namespace peeler {

BackgroundSink::BackgroundSink(std::unique_ptr<Sink> sink) : sink_(std::move(sink)) {
    try {
        thread_ = startWorker([this] { work(); });
    } catch (const Error&) {
        // A process limit may forbid the thread. The caller then does the work itself, which is
        // slower but correct.
    }
}

BackgroundSink::~BackgroundSink() {
    if (!thread_.joinable()) return;
    {
        const std::lock_guard lock(mutex_);
        stop_ = true;
    }
    changed_.notify_all();
    thread_.join();
}

void BackgroundSink::work() {
    std::unique_lock lock(mutex_);
    while (true) {
        changed_.wait(lock, [this] { return stop_ || task_; });
        if (stop_) return;
        lock.unlock();
        std::exception_ptr failure;
        try {
            task_();
        } catch (...) {
            failure = std::current_exception();
        }
        lock.lock();
        failure_ = failure;
        task_ = nullptr;
        changed_.notify_all();
    }
}

void BackgroundSink::give(std::function<void()> task) {
    if (!thread_.joinable()) return task();
    {
        const std::lock_guard lock(mutex_);
        task_ = std::move(task);
    }
    changed_.notify_all();
}

void BackgroundSink::write(LayeredImage&& band) {
    wait();
    std::swap(band_, band);
    give([this] { sink_->write(std::move(band_)); });
}

void BackgroundSink::finish() {
    wait();
    give([this] {
        sink_->finish();
        finished_at_ = std::chrono::steady_clock::now();
    });
}

void BackgroundSink::wait() {
    std::unique_lock lock(mutex_);
    changed_.wait(lock, [this] { return !task_; });
    if (failure_) std::rethrow_exception(std::exchange(failure_, nullptr));
}

SinkMemory BackgroundSink::memory(const Plan& plan) const {
    SinkMemory memory = sink_->memory(plan);
    ++memory.bands;
    return memory;
}

}  // namespace peeler
