// SPDX-License-Identifier: Apache-2.0
// Resizing of storage whose contents are discarded.
#pragma once

#include <cstddef>
#include <vector>

namespace peeler {

/// Resizes for contents that will be overwritten: never holds the old and the new storage at once.
/// Reserves `most` elements if that is enough, else a little more than `size`, for the next band;
/// reserved memory is not resident until used.
template <class T, class Allocator>
void resizeAnew(std::vector<T, Allocator>& values, std::size_t size, std::size_t most = 0) {
    if (values.capacity() < size) {
        values = {};
        values.reserve(most >= size ? most : size + size / 8);
    }
    values.resize(size);
}

}  // namespace peeler
