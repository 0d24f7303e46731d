// SPDX-License-Identifier: Apache-2.0
// The hash that tells one scene's bytes from another's.
#pragma once

#include <cstddef>
#include <cstdint>
#include <span>

namespace peeler {

/// XXH64 (xxhash.com) of the bytes; `seed` is the hash of what came before them.
std::uint64_t contentHash(std::span<const std::byte> bytes, std::uint64_t seed);

}  // namespace peeler
