// SPDX-License-Identifier: Apache-2.0
// The Renderer's worker thread. The Renderer's GL context is current on it, so the context of the
// caller's thread is never touched.
#pragma once

#include <condition_variable>
#include <exception>
#include <functional>
#include <mutex>
#include <optional>
#include <thread>

#include "core/fragments/hit_source.h"

namespace peeler {

/// A worker that runs jobs one after another. Any thread may submit a job and then waits until the
/// job is done.
class Worker {
  public:
    /// A job. It reports progress by calling its argument, which throws if the job has been
    /// cancelled.
    using Work = std::function<void(const Progress&)>;

    /// `own_thread`: whether jobs run on a thread of the worker; else they run on the calling
    /// thread.
    explicit Worker(bool own_thread);
    ~Worker();
    Worker(const Worker&) = delete;
    Worker& operator=(const Worker&) = delete;

    /// Runs the job and waits for it. Calls `progress` on the calling thread, every few hundredths
    /// of a second; an exception from `progress` cancels the job. Rethrows exceptions from
    /// `progress` and from the job.
    void run(const Work& work, const Progress& progress);

  private:
    void serve();

    std::mutex one_at_a_time_;
    std::mutex mutex_;
    std::condition_variable changed_;
    const Work* work_ = nullptr;  ///< the pending or running job
    double share_ = 0;
    bool given_up_ = false, end_ = false;
    std::exception_ptr failure_;
    std::optional<std::thread> thread_;
};

}  // namespace peeler
