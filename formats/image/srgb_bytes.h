// SPDX-License-Identifier: Apache-2.0
// sRGB bytes of linear values without a power for each.
#pragma once

#include <array>
#include <bit>
#include <cstddef>
#include <cstdint>

namespace peeler {

/// round(255 · encodeSrgb(linear)) exactly, for every float; NaN becomes 0.
class SrgbBytes {
  public:
    /// Finds by bisection where each byte begins.
    SrgbBytes();

    std::uint8_t operator()(float linear) const {
        if (!(linear >= begins_[1])) return 0;
        if (linear >= 1) return 255;
        std::size_t byte = first_[bucketOf(linear)];
        while (linear >= begins_[byte + 1])
            ++byte;
        return static_cast<std::uint8_t>(byte);
    }

  private:
    /// Exponent and 6 bits of the mantissa, from 2^-13 on: about one byte begins in each.
    static constexpr unsigned kShift = 17;
    static constexpr std::uint32_t kFirst = std::bit_cast<std::uint32_t>(0x1p-13F) >> kShift,
                                   kEnd = std::bit_cast<std::uint32_t>(1.0F) >> kShift;
    static std::size_t bucketOf(float linear) {
        return (std::bit_cast<std::uint32_t>(linear) >> kShift) - kFirst;
    }

    std::array<float, 257> begins_;                    ///< the least float of each byte; the end
    std::array<std::uint8_t, kEnd - kFirst> first_{};  ///< byte at the beginning of each bucket
};

}  // namespace peeler
