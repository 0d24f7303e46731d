// SPDX-License-Identifier: Apache-2.0
// The inverse of ExrChunkPacker, for chunks that nobody vouches for.
#pragma once

#include <cstddef>
#include <cstdint>
#include <span>
#include <string>
#include <vector>

namespace peeler {

/// The most bytes that `packed` ones can become: what a size in a file is held against before
/// memory is allocated by it. 0 for a compression that deep data cannot have.
std::uint64_t exrMostUnpacked(const std::string& compression, std::uint64_t packed);

/// Unpacks a chunk of "none", "rle", "zips" or "zip" (ExrInputPart::compression) into `out`, which
/// has the size that it must have; one of that size is not packed. Returns false if it does not
/// unpack to exactly that.
bool exrUnpack(const std::string& compression, std::span<const std::byte> packed,
               std::span<std::byte> out);

/// The same of a chunk that is known to be packed, even if that has not made it smaller.
bool exrUnpackAlways(const std::string& compression, std::span<const std::byte> packed,
                     std::span<std::byte> out);

}  // namespace peeler
