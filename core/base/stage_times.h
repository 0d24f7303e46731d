// SPDX-License-Identifier: Apache-2.0
// Timers of stages.
#pragma once

#include <chrono>

#include <peeler/stage_times.h>

namespace peeler {

/// Adds the time from construction to destruction to one stage.
class StageTimer {
  public:
    StageTimer(StageTimes& times, const char* stage) : milliseconds_(times[stage]) {}
    ~StageTimer() {
        const std::chrono::duration<double, std::milli> passed = Clock::now() - start_;
        milliseconds_ += passed.count();
    }
    StageTimer(const StageTimer&) = delete;
    StageTimer& operator=(const StageTimer&) = delete;

  private:
    using Clock = std::chrono::steady_clock;
    double& milliseconds_;  // a map's nodes stay where they are
    Clock::time_point start_ = Clock::now();
};

/// What `work()` returns; its time goes to the stage.
template <class Work>
auto timed(StageTimes& times, const char* stage, Work&& work) {
    const StageTimer timer(times, stage);
    return work();
}

/// Adds the times of every stage to those of another.
inline void add(StageTimes& to, const StageTimes& from) {
    for (const auto& [stage, milliseconds] : from)
        to[stage] += milliseconds;
}

}  // namespace peeler
