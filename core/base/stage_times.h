// SPDX-License-Identifier: Apache-2.0
// Stage timers.
#pragma once

#include <chrono>

#include <peeler/stage_times.h>

namespace peeler {

/// A scoped timer: adds the time between its construction and destruction to the time of a stage.
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
    double& milliseconds_;  // stays valid, since map nodes do not move
    Clock::time_point start_ = Clock::now();
};

/// Returns the result of `work()`. Adds the call's time to the stage.
template <class Work>
auto timed(StageTimes& times, const char* stage, Work&& work) {
    const StageTimer timer(times, stage);
    return work();
}

inline void add(StageTimes& to, const StageTimes& from) {
    for (const auto& [stage, milliseconds] : from)
        to[stage] += milliseconds;
}

}  // namespace peeler
