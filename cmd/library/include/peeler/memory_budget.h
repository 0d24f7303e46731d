// SPDX-License-Identifier: Apache-2.0
// The memory budget, and its source.
#pragma once

#include <cstdint>
#include <string>
#include <utility>

#include <peeler/text.h>

#pragma GCC visibility push(default)

namespace peeler::inline v0 {

/// The limit on resident bytes that peeler adds to the process. Converts from and to a number of
/// bytes; 0 = no limit.
struct MemoryBudget {
    // NOLINTNEXTLINE(google-explicit-constructor): a budget without a source is a number
    MemoryBudget(std::uint64_t most = 0, std::string from = {})
        : bytes(most), source(std::move(from)) {}

    // NOLINTNEXTLINE(google-explicit-constructor)
    operator std::uint64_t() const { return bytes; }

    /// Returns Error::where() of an exceeded budget: "`memory` 512M", or the source.
    Text where() const;
    /// Returns the hint of an Error if `needed` bytes would suffice.
    Text hint(std::uint64_t needed) const;

    std::uint64_t bytes;
    /// Resident bytes that belong to the host process and do not count. 0 in peeler's own process.
    std::uint64_t base = 0;
    /// A clause: "the cgroup /job_7 (memory.max) allows 2048M"; empty = set by the caller.
    std::string source;
};

}  // namespace peeler::inline v0

#pragma GCC visibility pop
