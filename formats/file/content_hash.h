// SPDX-License-Identifier: Apache-2.0
// Hashes: what tells one scene, or one set of options, from another, and how a hash stands in
// files.
#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <span>
#include <string>
#include <string_view>

namespace peeler {

/// XXH64 (xxhash.com) of the bytes; `seed` is the hash of what came before them.
std::uint64_t contentHash(std::span<const std::byte> bytes, std::uint64_t seed);

/// XXH64, with seed 0, of bytes that are added piece after piece, however they are cut.
class ContentHasher {
  public:
    ContentHasher();
    void add(std::span<const std::byte> bytes);
    std::uint64_t value() const;  ///< of what was added so far

  private:
    alignas(std::uint64_t) std::array<std::byte, 88> state_;  ///< XXH64_state_t
};

/// 64-bit FNV-1a of the text, as 16 hexadecimal digits.
std::string hashText(const std::string& text);
/// The value as 16 hexadecimal digits, lower case.
std::string hexText(std::uint64_t value);

/// Provenance::output_hash as it stands in flat images (ImageDescription) and pages (meta).
std::string outputHashText(const std::string& hash);
/// The inverse: the hash in a text, "" if there is none.
std::string outputHashIn(std::string_view text);

}  // namespace peeler
