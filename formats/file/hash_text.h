// SPDX-License-Identifier: Apache-2.0
// Hashes as they stand in files: 16 hexadecimal digits.
#pragma once

#include <cstdint>
#include <string>

namespace peeler {

/// 64-bit FNV-1a of the text, as 16 hexadecimal digits.
std::string hashText(const std::string& text);
std::string hexText(std::uint64_t value);

}  // namespace peeler
