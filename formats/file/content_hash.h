// SPDX-License-Identifier: Apache-2.0
// Hashes: what tells one scene, or one set of options, from another, and how a hash stands in
// files.
#pragma once

#include <cstddef>
#include <cstdint>
#include <span>
#include <string>
#include <string_view>

namespace peeler {

/// XXH64 (xxhash.com) of the bytes; `seed` is the hash of what came before them.
std::uint64_t contentHash(std::span<const std::byte> bytes, std::uint64_t seed);

/// 64-bit FNV-1a of the text, as 16 hexadecimal digits.
std::string hashText(const std::string& text);
/// The value as 16 hexadecimal digits, lower case.
std::string hexText(std::uint64_t value);

/// Provenance::output_hash as it stands in flat images (ImageDescription) and pages (meta).
std::string outputHashText(const std::string& hash);
/// The inverse: the hash in a text, "" if there is none.
std::string outputHashIn(std::string_view text);

}  // namespace peeler
