// SPDX-License-Identifier: Apache-2.0
// The Renderer's worker thread, on which the Renderer's own GL context is current. The context of
// the caller's thread is never touched.
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
    /// A job. Reports progress by calling its argument, which throws if the job has been cancelled.
    using Work = std::function<void(const Progress&)>;

    /// If `own_thread`, jobs run on the worker's own thread. Otherwise, jobs run on the calling
    /// thread, as a borrowed GL context requires.
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
