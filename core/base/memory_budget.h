// SPDX-License-Identifier: Apache-2.0
// Bytes as texts have them.
#pragma once

#include <cstdint>
#include <string>

namespace peeler {

/// A number of bytes in mebibytes, rounded up: "512M".
std::string mebibytesText(std::uint64_t bytes);

}  // namespace peeler
