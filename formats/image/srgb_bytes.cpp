// SPDX-License-Identifier: Apache-2.0
// The table of SrgbBytes.
//
// The bit patterns of positive floats have the same order as their values, so bisecting the bit
// patterns finds the least float for each byte.
#include "formats/image/image_writer.h"

#include <cmath>
#include <limits>

namespace peeler {

SrgbBytes::SrgbBytes() {
    std::uint32_t begin = 0;  // least float, as bits, that encodes to the previous byte
    for (std::size_t byte = 0; byte < 256; ++byte) {
        std::uint32_t end = std::bit_cast<std::uint32_t>(1.0F);
        while (begin < end) {
            const std::uint32_t middle = begin + (end - begin) / 2;
            const float encoded = encodeSrgb(std::bit_cast<float>(middle));
            if (std::lround(encoded * 255) < static_cast<long>(byte))
                begin = middle + 1;
            else
                end = middle;
        }
        begins_[byte] = std::bit_cast<float>(begin);
    }
    begins_[256] = std::numeric_limits<float>::infinity();
    std::size_t byte = 0;
    for (std::uint32_t bucket = kFirst; bucket < kEnd; ++bucket) {
        while (begins_[byte + 1] <= std::bit_cast<float>(bucket << kShift))
            ++byte;
        first_[bucket - kFirst] = static_cast<std::uint8_t>(byte);
    }
}

}  // namespace peeler
