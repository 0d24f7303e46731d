// SPDX-License-Identifier: Apache-2.0
// A sink that writes in the background while its caller captures the next band.
#pragma once

#include <chrono>
#include <condition_variable>
#include <exception>
#include <functional>
#include <memory>
#include <mutex>
#include <thread>

#include <peeler/sink.h>

namespace peeler {

/// A sink that passes bands to another sink on a thread of its own. write() waits until the
/// previous band is written, takes the new one and leaves the previous one's storage in its
/// argument. finish() waits for the last band and starts finish() of the other sink; wait() waits
/// until that is done, too. If no thread can be started, the caller does all the work. The next
/// call of any of the three rethrows an exception from the other sink.
class BackgroundSink final : public Sink {
  public:
    explicit BackgroundSink(std::unique_ptr<Sink> sink);
    /// Waits for the band being written; discards all unfinished work.
    ~BackgroundSink() override;

    void begin(const Plan& plan) override { sink_->begin(plan); }
    void write(LayeredImage&& band) override;
    void finish() override;
    /// Waits until everything is written and finished.
    void wait();

    SinkMemory memory(const Plan& plan) const override;
    StageTimes times() const override { return sink_->times(); }  ///< only after wait()
    /// Returns the time when finish() completed; only after wait().
    std::chrono::steady_clock::time_point finishedAt() const { return finished_at_; }

  private:
    void work();
    void give(std::function<void()> task);

    std::unique_ptr<Sink> sink_;
    LayeredImage band_;           ///< the band being written
    std::function<void()> task_;  ///< empty: idle
    std::chrono::steady_clock::time_point finished_at_;
    bool stop_ = false;
    std::exception_ptr failure_;
    std::mutex mutex_;
    std::condition_variable changed_;
    std::thread thread_;
};

}  // namespace peeler
