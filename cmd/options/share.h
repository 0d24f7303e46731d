// SPDX-License-Identifier: Apache-2.0
// "2/5": one of so many parts, for work that several processes divide among themselves.
#pragma once

#include <cstddef>
#include <string>
#include <string_view>
#include <utility>

namespace peeler::cmd {

struct Share {
    int index = 1;  ///< from 1 to count
    int count = 1;

    /// The half-open range of `items` things that is this share: all shares together have each
    /// once, in order, and differ by one in size at most.
    std::pair<std::size_t, std::size_t> of(std::size_t items) const;
    std::string text() const { return std::to_string(index) + '/' + std::to_string(count); }
};

/// "I/N" with 1 ≤ I ≤ N. Throws Error (kUsage).
Share parseShare(std::string_view text);

}  // namespace peeler::cmd
