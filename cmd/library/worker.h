// SPDX-License-Identifier: Apache-2.0
// A thread that a Renderer's context is current on, so that nobody else's ever is touched.
#pragma once

#include <condition_variable>
#include <exception>
#include <functional>
#include <mutex>
#include <optional>
#include <thread>

#include "core/fragments/hit_source.h"

namespace peeler {

/// Does one work after the other, for any thread that asks: each waits for its own.
class Worker {
  public:
    /// What is done; it tells its progress through the argument, which throws where the work was
    /// given up.
    using Work = std::function<void(const Progress&)>;

    /// `own_thread`: false = work is done on the thread that asks.
    explicit Worker(bool own_thread);
    ~Worker();
    Worker(const Worker&) = delete;
    Worker& operator=(const Worker&) = delete;

    /// Does the work and waits for it. `progress` is called on the calling thread, every few
    /// hundredths of a second; what it throws gives the work up and is thrown on, and so is what
    /// the work throws.
    void run(const Work& work, const Progress& progress);

  private:
    void serve();

    std::mutex one_at_a_time_;
    std::mutex mutex_;
    std::condition_variable changed_;
    const Work* work_ = nullptr;  ///< what is to be done or being done
    double share_ = 0;
    bool given_up_ = false, end_ = false;
    std::exception_ptr failure_;
    std::optional<std::thread> thread_;
};

}  // namespace peeler
