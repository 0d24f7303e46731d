// SPDX-License-Identifier: Apache-2.0
// The memory budget, and its source.
#pragma once

#include <cstdint>
#include <string>
#include <utility>

#include <peeler/text.h>

#pragma GCC visibility push(default)

namespace peeler::inline v0 {

/// The most resident bytes that peeler adds to the process. Converts from and to a number of bytes;
/// 0 = no budget.
struct MemoryBudget {
    // NOLINTNEXTLINE(google-explicit-constructor): a budget without a source is a number
    MemoryBudget(std::uint64_t most = 0, std::string from = {})
        : bytes(most), source(std::move(from)) {}

    // NOLINTNEXTLINE(google-explicit-constructor)
    operator std::uint64_t() const { return bytes; }

    /// Where an Error happens that is over the budget: "`memory` 512M", or the source.
    Text where() const;
    /// What to do where `needed` bytes would do.
    Text hint(std::uint64_t needed) const;

    std::uint64_t bytes;
    /// Of the process, resident before and held by somebody else: they do not count. 0 where the
    /// process is ours.
    std::uint64_t base = 0;
    /// A sentence: "the cgroup /job_7 (memory.max) allows 2048M"; empty = the caller.
    std::string source;
};

}  // namespace peeler::inline v0

#pragma GCC visibility pop
