// SPDX-License-Identifier: Apache-2.0
// Sparse sets: few items out of a large range of numbers.
#pragma once

#include <cstddef>
#include <cstdint>
#include <utility>
#include <vector>

namespace peeler {

/// A set of numbered items in order of first access (Briggs & Torczon 1993, "An Efficient
/// Representation for Sparse Sets"). Lookup and clearing take constant time for any range of
/// numbers. Memory is 4 bytes per number, allocated once.
template <class Item>
class SparseSet {
  public:
    struct Entry {
        std::uint32_t number;
        Item item;
    };

    /// Removes all items and sets the range of numbers to [0, numbers).
    void begin(std::size_t numbers) {
        entries_.clear();
        if (places_.size() < numbers) places_.resize(numbers);
    }
    /// Returns the item with this number, value-initialised on first access.
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
    // For each number: the index of its entry. The index is valid only if the entry at this index
    // has the same number.
    std::vector<std::uint32_t> places_;
    std::vector<Entry> entries_;
};

}  // namespace peeler
