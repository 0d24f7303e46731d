// SPDX-License-Identifier: Apache-2.0
// A buffer of bytes for somebody to fill, which a plain std::vector would set to zero first, and
// how numbers are put into one.
#pragma once

#include <cstddef>
#include <cstring>
#include <memory>
#include <new>
#include <utility>
#include <vector>

namespace peeler {

/// An allocator that leaves elements uninitialised if no value is given for them.
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

/// A vector of bytes; those that resize() adds are undefined.
using ByteBuffer = std::vector<std::byte, UnsetAllocator<std::byte>>;

/// Copies a number, or an array of them, to `out` as it lies in memory. Returns the end of the
/// copy.
template <class T>
std::byte* storeNumber(const T& number, std::byte* out) {
    std::memcpy(out, &number, sizeof number);
    return out + sizeof number;
}

}  // namespace peeler
