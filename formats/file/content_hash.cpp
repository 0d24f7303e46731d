// SPDX-License-Identifier: Apache-2.0
// Hashes: XXH64 for contents, FNV-1a for texts, and the line that stores an output hash in files.
#include "formats/file/content_hash.h"

#define XXH_INLINE_ALL  // inlines XXH64, so that no library is linked
#include <xxhash.h>

#include <cstdio>
#include <new>

namespace peeler {
namespace {

constexpr std::string_view kOutputHashName = "peeler:outputHash ";
constexpr std::size_t kHashDigits = 16;

static_assert(sizeof(XXH64_state_t) == 88 && alignof(XXH64_state_t) <= alignof(std::uint64_t));

}  // namespace

ContentHasher::ContentHasher() {
    XXH64_reset(new (state_.data()) XXH64_state_t, 0);
}

void ContentHasher::add(std::span<const std::byte> bytes) {
    XXH64_update(reinterpret_cast<XXH64_state_t*>(state_.data()), bytes.data(), bytes.size());
}

std::uint64_t ContentHasher::value() const {
    return XXH64_digest(reinterpret_cast<const XXH64_state_t*>(state_.data()));
}

std::uint64_t contentHash(std::span<const std::byte> bytes, std::uint64_t seed) {
    return XXH64(bytes.data(), bytes.size(), seed);
}

std::string hashText(const std::string& text) {
    std::uint64_t hash = 0xcbf29ce484222325U;
    for (const char c : text) {
        hash ^= static_cast<unsigned char>(c);
        hash *= 0x100000001b3U;
    }
    return hexText(hash);
}

std::string hexText(std::uint64_t value) {
    char digits[kHashDigits + 1];
    std::snprintf(digits, sizeof digits, "%016llx", static_cast<unsigned long long>(value));
    return digits;
}

std::string outputHashText(const std::string& hash) {
    return hash.empty() ? "" : std::string(kOutputHashName) + hash;
}

std::string outputHashIn(std::string_view text) {
    const std::size_t at = text.find(kOutputHashName);
    if (at == std::string_view::npos || text.size() < at + kOutputHashName.size() + kHashDigits)
        return "";
    return std::string(text.substr(at + kOutputHashName.size(), kHashDigits));
}

}  // namespace peeler
