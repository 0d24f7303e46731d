// SPDX-License-Identifier: Apache-2.0
// A step limit, which lets calculations end within seconds even for heavily self-intersecting
// surfaces.
#pragma once

#include <atomic>
#include <cstddef>
#include <cstdint>
#include <functional>

#include <peeler/work.h>

namespace peeler {

/// A step counter that several threads share. The total, and so the results, do not depend on the
/// order in which the threads add to it.
class StepLimit {
  public:
    explicit StepLimit(std::uint64_t most) : most_(most) {}

    void take(std::uint64_t steps) { taken_.fetch_add(steps, std::memory_order_relaxed); }
    bool exceeded() const { return taken_.load(std::memory_order_relaxed) > most_; }

  private:
    std::uint64_t most_;
    std::atomic<std::uint64_t> taken_{0};
};

/// Runs parallelFor() until the limit is exceeded. Calls `progress` with the finished fraction, on
/// the caller's thread, at most 100 times. Returns whether all items finished within the limit.
bool parallelFor(std::size_t items, StepLimit& limit, const Progress& progress,
                 const std::function<void(std::size_t)>& body);

}  // namespace peeler
