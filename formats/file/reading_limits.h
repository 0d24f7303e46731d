// SPDX-License-Identifier: Apache-2.0
// Memory limits for reading input. They are checked before each allocation whose size comes from
// the file.
#pragma once

#include <cstdint>
#include <string>

#include <peeler/memory_budget.h>

namespace peeler {

/// Throws Error (kMemory) with the place `where` if `needed`, in bytes of the whole process,
/// exceeds the budget.
void checkReadingMemory(const MemoryBudget& budget, std::uint64_t needed, const std::string& where);

/// The memory used for reading, checked against a budget. Not thread-safe.
class ReadingMemory {
  public:
    explicit ReadingMemory(MemoryBudget budget);

    const MemoryBudget& budget() const { return budget_; }
    /// Throws Error (kMemory) if an allocation of this size would exceed the budget. Call it before
    /// any allocation whose size depends on a file.
    void allow(std::uint64_t bytes, const std::string& where);
    /// Returns the rest of the budget, in bytes. Call it only if the budget is limited.
    std::uint64_t left() const;

  private:
    MemoryBudget budget_;
    std::uint64_t unseen_ = 0;  ///< bytes allowed since the last check of the resident memory
};

/// A limit on the total bytes of one kind of data in a file, independent of the memory budget.
class SizeLimit {
  public:
    /// `what` begins the message, for example "the geometry needs".
    SizeLimit(const char* what, std::uint64_t most) : what_(what), most_(most) {}

    /// Throws Error (kInput) if `more` bytes would exceed the limit.
    void check(std::uint64_t more, const std::string& where) const;
    void take(std::uint64_t bytes, const std::string& where) {
        check(bytes, where);
        taken_ += bytes;
    }
    std::uint64_t taken() const { return taken_; }

  private:
    const char* what_;
    std::uint64_t most_, taken_ = 0;
};

}  // namespace peeler
