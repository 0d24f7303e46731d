// SPDX-License-Identifier: Apache-2.0
// Decodes one Draco-compressed mesh.
#pragma once

#include <cstdint>
#include <span>
#include <vector>

namespace peeler {

/// An attribute as a glTF accessor describes it.
struct DracoAttribute {
    std::uint32_t unique_id = 0;  ///< in the compressed data
    int component_type = 5126;    ///< glTF's number, 5120 BYTE … 5126 FLOAT
    int components = 1;
};

/// What may come out at most; more is refused, before memory is allocated for it where the data
/// says it in advance.
struct DracoLimits {
    std::uint64_t faces = 0, points = 0;
    int cpu_seconds = 10;  ///< a million triangles take about one
};

struct DracoMesh {
    std::vector<std::uint32_t> indices;  ///< three a triangle, all below `points`
    std::size_t points = 0;
    /// In the order they were asked for: points · components numbers, tightly packed.
    std::vector<std::vector<std::uint8_t>> attributes;
};

/// Decodes a triangle mesh (sequential or Edgebreaker; a strip is decoded to its triangles too).
/// libdraco 1.5.5 reads 2^31 bits of orientations where one byte of a few thousand vertices is
/// wrong, so it runs in a process of its own, which may take `cpu_seconds` and memory in proportion
/// to what is promised. May be called from several threads. Throws Error(kInput) with an empty
/// `where`.
DracoMesh decodeDracoMesh(std::span<const std::uint8_t> bytes,
                          std::span<const DracoAttribute> attributes, const DracoLimits& limits);

}  // namespace peeler
