// SPDX-License-Identifier: Apache-2.0
// The memory budget.
#pragma once

#include <cstdint>
#include <string>
#include <utility>

#include <peeler/text.h>

#pragma GCC visibility push(default)

namespace peeler::inline v0 {

/// The maximum number of resident bytes that peeler may add to the process. Converts to and from a
/// number of bytes; 0 = no limit.
struct MemoryBudget {
    // NOLINTNEXTLINE(google-explicit-constructor): so that a plain number can be passed as a budget
    MemoryBudget(std::uint64_t most = 0, std::string from = {})
        : bytes(most), source(std::move(from)) {}

    // NOLINTNEXTLINE(google-explicit-constructor)
    operator std::uint64_t() const { return bytes; }

    /// Returns the text for Error::where() if the budget is exceeded: "`memory` 512M", or the
    /// source.
    Text where() const;
    /// Returns the hint for an Error. `needed` is the number of bytes for a task, which exceeds the
    /// budget.
    Text hint(std::uint64_t needed) const;

    std::uint64_t bytes;
    /// Resident bytes of the host process that do not count towards the limit; 0 in peeler's own
    /// process.
    std::uint64_t base = 0;
    /// The origin of the limit, as a clause: "the cgroup /job_7 (memory.max) allows 2048M"; "" =
    /// set by the caller.
    std::string source;
};

}  // namespace peeler::inline v0

#pragma GCC visibility pop
