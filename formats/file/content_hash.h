// SPDX-License-Identifier: Apache-2.0
// Hashes that identify scenes and sets of options, and the text form of the output hash in files.
#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <span>
#include <string>
#include <string_view>

namespace peeler {

/// Returns the XXH64 (xxhash.com) of the bytes; `seed` is 0, or the hash of the preceding bytes.
std::uint64_t contentHash(std::span<const std::byte> bytes, std::uint64_t seed);

/// A streaming XXH64 with seed 0; the result does not depend on how the bytes are split.
class ContentHasher {
  public:
    ContentHasher();
    void add(std::span<const std::byte> bytes);
    std::uint64_t value() const;

  private:
    alignas(std::uint64_t) std::array<std::byte, 88> state_;  ///< storage of an XXH64_state_t
};

/// Returns the 64-bit FNV-1a of the text, as 16 hexadecimal digits.
std::string hashText(const std::string& text);
/// Returns the value as 16 hexadecimal digits in lower case.
std::string hexText(std::uint64_t value);

/// Returns the text that stores an output hash (Provenance::output_hash) in flat images
/// (ImageDescription) and pages (meta).
std::string outputHashText(const std::string& hash);
/// Returns the hash in a text of outputHashText(), or "" for any other text.
std::string outputHashIn(std::string_view text);

}  // namespace peeler
