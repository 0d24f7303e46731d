// SPDX-License-Identifier: Apache-2.0
// PNG (ISO/IEC 15948) with libspng, which loads in a millisecond.
#pragma once

#include <cstdint>
#include <memory>
#include <span>
#include <string>

#include "formats/image/image_library.h"

namespace peeler {

/// Every kind of PNG. Grey of less than 8 bits comes as 8, a palette as its colours, transparent
/// colours as alpha. Nothing is allocated for the pixels before they are read. Throws
/// std::runtime_error.
std::unique_ptr<ImageDecoder> pngDecoder(const std::string& path,
                                         std::span<const std::uint8_t> bytes);

/// Of 1 to 4 channels. If it is destroyed before close(), what it has written is left as it is.
std::unique_ptr<ImageEncoder> pngEncoder();

}  // namespace peeler
