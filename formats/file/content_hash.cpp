// SPDX-License-Identifier: Apache-2.0
#include "formats/file/content_hash.h"

#define XXH_INLINE_ALL  // it is one function: no library to load
#include <xxhash.h>

namespace peeler {

std::uint64_t contentHash(std::span<const std::byte> bytes, std::uint64_t seed) {
    return XXH64(bytes.data(), bytes.size(), seed);
}

}  // namespace peeler
