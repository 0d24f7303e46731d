// SPDX-License-Identifier: Apache-2.0
// Storage that is used again for other contents.
#pragma once

#include <cstddef>
#include <vector>

namespace peeler {

/// resize() for contents that will be overwritten: never holds the old and the new storage at once.
/// There is room for `most` or a little more, as the next band may have, which takes no memory
/// until then.
template <class T, class Allocator>
void resizeAnew(std::vector<T, Allocator>& values, std::size_t size, std::size_t most = 0) {
    if (values.capacity() < size) {
        values = {};
        values.reserve(most >= size ? most : size + size / 8);
    }
    values.resize(size);
}

}  // namespace peeler
