// SPDX-License-Identifier: Apache-2.0
// A sink that works in the background, while its caller captures what comes next.
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

/// Hands bands on to another sink from a thread of its own: write() takes the band once the one
/// before is written and gives the storage of that one back, finish() returns at once, and wait()
/// tells how it ended. Where no thread can be had everything is done by the caller. What the other
/// sink throws is thrown by the next write(), or by wait().
class BackgroundSink final : public Sink {
  public:
    explicit BackgroundSink(std::unique_ptr<Sink> sink);
    /// Waits for the band that is being written; what has not been finished is given up.
    ~BackgroundSink() override;

    void begin(const Plan& plan) override { sink_->begin(plan); }
    void write(LayeredImage&& band) override;
    void finish() override;
    /// Until everything is written and finished.
    void wait();

    SinkMemory memory(const Plan& plan) const override;
    StageTimes times() const override { return sink_->times(); }  ///< after wait()
    /// When finish() was done with; after wait().
    std::chrono::steady_clock::time_point finishedAt() const { return finished_at_; }

  private:
    void work();
    void give(std::function<void()> task);

    std::unique_ptr<Sink> sink_;
    LayeredImage band_;           ///< that is being written
    std::function<void()> task_;  ///< empty: there is nothing to do
    std::chrono::steady_clock::time_point finished_at_;
    bool stop_ = false;
    std::exception_ptr failure_;
    std::mutex mutex_;
    std::condition_variable changed_;
    std::thread thread_;
};

}  // namespace peeler
