// SPDX-License-Identifier: Apache-2.0
// JPEG (ITU-T T.81) with libjpeg-turbo's own interface, which loads in a millisecond.
#pragma once

#include <cstdint>
#include <memory>
#include <span>
#include <string>

#include "formats/image/image_library.h"

namespace peeler {

/// Grey and colour; CMYK becomes RGB. Nothing is allocated for the pixels before they are read.
/// Nothing is returned for what is left to the module: unusual subsampling, damaged headers, and
/// files without `bytes`, since their descriptions are in Exif too. Pixels that are damaged are
/// read by it as well. Throws std::bad_alloc.
std::unique_ptr<ImageDecoder> jpegDecoder(const std::string& path,
                                          std::span<const std::uint8_t> bytes);

}  // namespace peeler
