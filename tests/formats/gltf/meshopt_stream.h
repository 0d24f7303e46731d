// SPDX-License-Identifier: Apache-2.0
// meshopt streams for tests of the decoder, compressed with the library's own encoders.
#pragma once

#include <meshoptimizer.h>

#include <cstdint>
#include <vector>

namespace peeler::test {

inline std::vector<std::uint8_t> encodeAttributes(const void* values, std::size_t count,
                                                  std::size_t stride) {
    std::vector<std::uint8_t> bytes(meshopt_encodeVertexBufferBound(count, stride));
    bytes.resize(meshopt_encodeVertexBuffer(bytes.data(), bytes.size(), values, count, stride));
    return bytes;
}

inline std::vector<std::uint8_t> encodeTriangles(const std::vector<unsigned int>& indices) {
    std::vector<std::uint8_t> bytes(meshopt_encodeIndexBufferBound(indices.size(), 1U << 20U));
    bytes.resize(
        meshopt_encodeIndexBuffer(bytes.data(), bytes.size(), indices.data(), indices.size()));
    return bytes;
}

inline std::vector<std::uint8_t> encodeIndices(const std::vector<unsigned int>& indices) {
    std::vector<std::uint8_t> bytes(meshopt_encodeIndexSequenceBound(indices.size(), 1U << 20U));
    bytes.resize(
        meshopt_encodeIndexSequence(bytes.data(), bytes.size(), indices.data(), indices.size()));
    return bytes;
}

}  // namespace peeler::test
