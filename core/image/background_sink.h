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

/// A sink that passes bands to another sink on its own thread. write() waits until the previous
/// band is written, takes the new band, and returns the storage of the previous band in its
/// argument. finish() waits for the last band and starts the other sink's finish(). wait() waits
/// for everything, including the other sink's finish(). If no thread can be started, the caller
/// does all the work. An exception from the other sink is rethrown by the next of these calls.
class BackgroundSink final : public Sink {
  public:
    explicit BackgroundSink(std::unique_ptr<Sink> sink);
    /// Waits for the band that is being written; discards all other unfinished work.
    ~BackgroundSink() override;

    void begin(const Plan& plan) override { sink_->begin(plan); }
    void write(LayeredImage&& band) override;
    void finish() override;
    /// Waits until all bands are written and finish() has completed.
    void wait();

    SinkMemory memory(const Plan& plan) const override;
    /// Returns the sink's times. Valid only after wait().
    StageTimes times() const override { return sink_->times(); }
    /// Returns the time when finish() completed. Valid only after wait().
    std::chrono::steady_clock::time_point finishedAt() const { return finished_at_; }

  private:
    void work();
    void give(std::function<void()> task);

    std::unique_ptr<Sink> sink_;
    LayeredImage band_;           ///< the band being written
    std::function<void()> task_;  ///< empty if the thread is idle
    std::chrono::steady_clock::time_point finished_at_;
    bool stop_ = false;
    std::exception_ptr failure_;
    std::mutex mutex_;
    std::condition_variable changed_;
    std::thread thread_;
};

}  // namespace peeler
