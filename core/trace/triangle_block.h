// SPDX-License-Identifier: Apache-2.0
// Triangles of a leaf of the TriangleTree.
#pragma once

#include <array>
#include <cstddef>
#include <cstdint>

namespace peeler {

/// Up to eight triangles in single precision. The unit is 2^kVertexBits cells, so coordinates are
/// in [−1, 1].
struct alignas(32) TriangleBlock {
    static constexpr std::size_t kWidth = 8;
    static constexpr double kUnit = 0x1p-50;

    std::array<std::array<std::array<float, kWidth>, 3>, 3> corner;  ///< by corner and axis
    std::array<std::uint32_t, kWidth> triangle;
};

/// Some of the triangles of a block, as bits.
struct BlockPart {
    const TriangleBlock* block = nullptr;
    unsigned lanes = 0;
};

}  // namespace peeler
