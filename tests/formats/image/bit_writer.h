// SPDX-License-Identifier: Apache-2.0
// A bit stream that fills each byte from its lowest bit, as in UASTC and BasisLZ.
#pragma once

#include <cstddef>
#include <cstdint>

#include "support/test_support.h"

namespace peeler::test {

class BitWriter {
  public:
    void put(std::uint64_t value, std::size_t count) {
        for (std::size_t i = 0; i < count; ++i, ++count_) {
            if (count_ % 8 == 0) bytes_.push_back(0);
            bytes_.back() |= static_cast<std::uint8_t>((value >> i & 1U) << (count_ % 8));
        }
    }
    std::size_t count() const { return count_; }
    /// Returns the bytes written; zeros fill the last byte.
    const Bytes& bytes() const { return bytes_; }

  private:
    Bytes bytes_;
    std::size_t count_ = 0;
};

}  // namespace peeler::test
