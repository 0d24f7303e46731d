// SPDX-License-Identifier: Apache-2.0
// Decodes one meshopt-compressed buffer view (EXT_meshopt_compression, KHR_meshopt_compression).
#pragma once

#include <cstdint>
#include <span>
#include <string>

namespace peeler {

/// What the extension object says of a compressed stream, in its own words.
struct MeshoptStream {
    std::span<const std::uint8_t> bytes;  ///< the compressed ones
    std::string mode;                     ///< ATTRIBUTES, TRIANGLES, INDICES
    std::string filter = "NONE";          ///< NONE, OCTAHEDRAL, QUATERNION, EXPONENTIAL, COLOR
    std::uint64_t stride = 0;             ///< bytes of an element
    std::uint64_t count = 0;              ///< elements
};

/// Checks the rules of the extension ("for the extension object to be valid …") and that so many
/// elements can be in so few bytes: the formats spend at least a 64th of what they decode to (and a
/// byte for each triangle or index), so that a promise is judged before memory is allocated for it.
/// Throws Error(kInput) with an empty `where`.
void checkMeshoptStream(const MeshoptStream& stream);

/// Decodes a stream that has passed the check into `out`, which has count · stride bytes. May be
/// called from several threads. Throws Error(kInput) with an empty `where`.
void decodeMeshoptStream(const MeshoptStream& stream, std::span<std::uint8_t> out);

}  // namespace peeler
