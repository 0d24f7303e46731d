// SPDX-License-Identifier: Apache-2.0
// The Renderer's worker thread. Its GL context is current here, so the caller's is never touched.
#pragma once

#include <condition_variable>
#include <exception>
#include <functional>
#include <mutex>
#include <optional>
#include <thread>

#include "core/fragments/hit_source.h"

namespace peeler {

/// A worker that runs jobs one after another, from any thread. Each caller waits for its own job.
class Worker {
  public:
    /// A job. It reports progress through the argument, which throws if the job was cancelled.
    using Work = std::function<void(const Progress&)>;

    /// `own_thread`: false = jobs run on the calling thread.
    explicit Worker(bool own_thread);
    ~Worker();
    Worker(const Worker&) = delete;
    Worker& operator=(const Worker&) = delete;

    /// Runs the job and waits for it. Calls `progress` on the calling thread, every few hundredths
    /// of a second; an exception it throws cancels the job. Rethrows exceptions of `progress` and
    /// of the job.
    void run(const Work& work, const Progress& progress);

  private:
    void serve();

    std::mutex one_at_a_time_;
    std::mutex mutex_;
    std::condition_variable changed_;
    const Work* work_ = nullptr;  ///< pending or running job
    double share_ = 0;
    bool given_up_ = false, end_ = false;
    std::exception_ptr failure_;
    std::optional<std::thread> thread_;
};

}  // namespace peeler
