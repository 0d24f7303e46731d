// SPDX-License-Identifier: Apache-2.0
// Resizing of storage whose contents are discarded.
#pragma once

#include <cstddef>
#include <vector>

namespace peeler {

/// Resizes a vector whose contents will be overwritten. The old and the new storage never coexist.
/// A vector that must grow reserves `most` elements or, if `size` exceeds `most`, an eighth more
/// than `size`, for the next band. Reserved memory is not resident until used.
template <class T, class Allocator>
void resizeAnew(std::vector<T, Allocator>& values, std::size_t size, std::size_t most = 0) {
    if (values.capacity() < size) {
        values = {};
        values.reserve(most >= size ? most : size + size / 8);
    }
    values.resize(size);
}

}  // namespace peeler
