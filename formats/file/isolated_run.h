// SPDX-License-Identifier: Apache-2.0
// Runs a decoder that is not to be trusted with any input in a process of its own.
#pragma once

#include <cstdint>
#include <functional>
#include <vector>

namespace peeler {

struct IsolationLimits {
    int cpu_seconds = 10;
    std::uint64_t memory_bytes = std::uint64_t{1} << 30;  ///< beyond what this process has now
};

/// Calls `work` in a child process and returns what it returned. An Error that it throws is thrown
/// here with the same kind, what and hint. A child that crashes or goes over its limits ends in
/// Error(kInput) with an empty `where`, whose hint is `hint`. May be called from several threads;
/// `work` must not use threads itself. Throws Error(kInternal) if no process can be started.
std::vector<std::uint8_t> runIsolated(const std::function<std::vector<std::uint8_t>()>& work,
                                      const IsolationLimits& limits, const char* hint);

}  // namespace peeler
