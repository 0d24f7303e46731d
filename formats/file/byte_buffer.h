// SPDX-License-Identifier: Apache-2.0
// Byte buffer without zero-initialisation, and copying of numbers into raw bytes.
#pragma once

#include <cstddef>
#include <cstring>
#include <memory>
#include <new>
#include <utility>
#include <vector>

namespace peeler {

/// An allocator that leaves new elements without a value uninitialised.
template <class T>
struct UnsetAllocator : std::allocator<T> {
    UnsetAllocator() = default;
    template <class U>
    explicit UnsetAllocator(const UnsetAllocator<U>&) noexcept {}
    template <class U>
    struct rebind {
        using other = UnsetAllocator<U>;
    };
    template <class U>
    void construct(U* place) noexcept {
        ::new (static_cast<void*>(place)) U;
    }
    template <class U, class... Args>
    void construct(U* place, Args&&... args) {
        ::new (static_cast<void*>(place)) U(std::forward<Args>(args)...);
    }
};

/// A vector of bytes; resize() leaves new bytes undefined.
using ByteBuffer = std::vector<std::byte, UnsetAllocator<std::byte>>;

/// Copies the bytes of a number, or of an array of numbers, to `out`. Returns the end of the copy.
template <class T>
std::byte* storeNumber(const T& number, std::byte* out) {
    std::memcpy(out, &number, sizeof number);
    return out + sizeof number;
}

}  // namespace peeler
