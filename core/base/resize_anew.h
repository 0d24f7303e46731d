// SPDX-License-Identifier: Apache-2.0
// Resizing of storage whose contents are discarded.
#pragma once

#include <cstddef>
#include <vector>

namespace peeler {

/// Resizes a vector whose contents will be overwritten. To grow, frees the old storage first, then
/// reserves room for `most` elements; if `size` is greater than `most`, for an eighth more than
/// `size`, so that the next band may be larger. Reserved memory is not resident until it is used.
template <class T, class Allocator>
void resizeAnew(std::vector<T, Allocator>& values, std::size_t size, std::size_t most = 0) {
    if (values.capacity() < size) {
        values = {};
        values.reserve(most >= size ? most : size + size / 8);
    }
    values.resize(size);
}

}  // namespace peeler
