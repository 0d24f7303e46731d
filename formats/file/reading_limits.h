// SPDX-License-Identifier: Apache-2.0
// What a file that is read may take: each asks before it allocates what the file's numbers say.
#pragma once

#include <cstdint>
#include <string>

#include <peeler/memory_budget.h>

namespace peeler {

/// While input is read, for `where`: throws Error (kMemory) if `needed` bytes, of all that the
/// process holds, are over the budget.
void checkReadingMemory(const MemoryBudget& budget, std::uint64_t needed, const std::string& where);

/// What reading may take of a memory budget. Belongs to one thread.
class ReadingMemory {
  public:
    explicit ReadingMemory(MemoryBudget budget);

    const MemoryBudget& budget() const { return budget_; }
    /// Called before something is allocated that a file can make large: throws Error (kMemory) if
    /// so many bytes are not within the budget.
    void allow(std::uint64_t bytes, const std::string& where);
    /// What is left of the budget, which there must be.
    std::uint64_t left() const;

  private:
    MemoryBudget budget_;
    std::uint64_t unseen_ = 0;  ///< bytes allowed since the resident memory was looked at
};

/// The bytes that all of one kind in a file may take together, whatever memory there is.
class SizeLimit {
  public:
    /// `what` begins a sentence: "the geometry needs".
    SizeLimit(const char* what, std::uint64_t most) : what_(what), most_(most) {}

    /// Throws Error (kInput) if there is no room for so many more.
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
