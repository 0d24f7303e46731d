// SPDX-License-Identifier: Apache-2.0
// Few items out of many that numbers name.
#pragma once

#include <cstddef>
#include <cstdint>
#include <utility>
#include <vector>

namespace peeler {

/// Items by number, in the order in which they were first asked for (Briggs & Torczon 1993, "An
/// Efficient Representation for Sparse Sets"): finding one and clearing all take the same time
/// however many numbers there are. Memory is 4 bytes a number, once.
template <class Item>
class SparseSet {
  public:
    struct Entry {
        std::uint32_t number;
        Item item;
    };

    /// Forgets the items; numbers are less than `numbers` from now on.
    void begin(std::size_t numbers) {
        entries_.clear();
        if (places_.size() < numbers) places_.resize(numbers);
    }
    /// A new one is value-initialised.
    Item& operator[](std::uint32_t number) {
        std::uint32_t& place = places_[number];
        if (place >= entries_.size() || entries_[place].number != number) {
            place = static_cast<std::uint32_t>(entries_.size());
            entries_.push_back({number, Item{}});
        }
        return entries_[place].item;
    }
    const std::vector<Entry>& entries() const { return entries_; }
    std::vector<Entry> take() { return std::exchange(entries_, {}); }

  private:
    std::vector<std::uint32_t> places_;  // of each number, if the entry there is its own
    std::vector<Entry> entries_;
};

}  // namespace peeler
