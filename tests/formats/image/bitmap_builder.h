// SPDX-License-Identifier: Apache-2.0
// BMP and TGA files, built byte by byte.
#pragma once

#include <cstdint>

#include "support/test_support.h"

namespace peeler::test {

/// Adds a number as `size` bytes, little-endian.
inline void addNumber(Bytes& to, std::uint32_t value, std::size_t size) {
    for (std::size_t i = 0; i < size; ++i)
        to.push_back(static_cast<std::uint8_t>(value >> (8 * i)));
}

/// Returns a BMP with the header of Windows 3, followed by `colors` (a palette or masks) and
/// `pixels`.
inline Bytes bmp(int width, int height, std::uint32_t bits, std::uint32_t packing,
                 const Bytes& colors, const Bytes& pixels) {
    Bytes file = {'B', 'M'};
    addNumber(file, 0, 4);
    addNumber(file, 0, 4);
    addNumber(file, static_cast<std::uint32_t>(54 + colors.size()), 4);
    addNumber(file, 40, 4);
    addNumber(file, static_cast<std::uint32_t>(width), 4);
    addNumber(file, static_cast<std::uint32_t>(height), 4);
    addNumber(file, 1, 2);
    addNumber(file, bits, 2);
    addNumber(file, packing, 4);
    file.insert(file.end(), 12, 0);
    addNumber(file, bits <= 8 ? static_cast<std::uint32_t>(colors.size() / 4) : 0, 4);
    addNumber(file, 0, 4);
    file.insert(file.end(), colors.begin(), colors.end());
    file.insert(file.end(), pixels.begin(), pixels.end());
    return file;
}

/// Returns a TGA without a palette; `descriptor` says which corner comes first.
inline Bytes tga(std::uint8_t type, std::uint32_t width, std::uint32_t height, std::uint8_t bits,
                 std::uint8_t descriptor, const Bytes& pixels) {
    Bytes file(12, 0);
    file[2] = type;
    addNumber(file, width, 2);
    addNumber(file, height, 2);
    file.push_back(bits);
    file.push_back(descriptor);
    file.insert(file.end(), pixels.begin(), pixels.end());
    return file;
}

}  // namespace peeler::test
