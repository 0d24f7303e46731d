// SPDX-License-Identifier: Apache-2.0
// The numbers that tables of numbers are made of, and what file formats call them.
#pragma once

#include <bit>
#include <cstddef>
#include <cstdint>
#include <string_view>

namespace peeler {

enum class NumberType : std::uint8_t {
    kUint8,
    kInt32,
    kUint32,
    kInt64,
    kHalf,
    kFloat,
    kDouble,
};

struct NumberTypeInfo {
    std::size_t size;        ///< bytes
    std::string_view numpy;  ///< the dtype string of .npy headers
    std::string_view ply;    ///< "" = PLY has no such type
};

inline constexpr NumberTypeInfo kNumberTypes[] = {
    {1, "|u1", "uchar"}, {4, "<i4", "int"},   {4, "<u4", "uint"},   {8, "<i8", ""},
    {2, "<f2", ""},      {4, "<f4", "float"}, {8, "<f8", "double"},
};

inline constexpr const NumberTypeInfo& infoOf(NumberType type) {
    return kNumberTypes[static_cast<std::size_t>(type)];
}

// Numbers are written as they lie in memory.
static_assert(std::endian::native == std::endian::little);

}  // namespace peeler
