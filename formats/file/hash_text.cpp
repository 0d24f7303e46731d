// SPDX-License-Identifier: Apache-2.0
#include "formats/file/hash_text.h"

#include <cstdio>

namespace peeler {

std::string hashText(const std::string& text) {
    std::uint64_t hash = 0xcbf29ce484222325U;
    for (const char c : text) {
        hash ^= static_cast<unsigned char>(c);
        hash *= 0x100000001b3U;
    }
    return hexText(hash);
}

std::string hexText(std::uint64_t value) {
    char digits[17];
    std::snprintf(digits, sizeof digits, "%016llx", static_cast<unsigned long long>(value));
    return digits;
}

}  // namespace peeler
