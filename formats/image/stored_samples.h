// SPDX-License-Identifier: Apache-2.0
// Stored samples as the type that is asked for, with the bits that OpenImageIO gives.
#pragma once

#include <cstddef>
#include <limits>
#include <type_traits>

namespace peeler {

/// The whole range of an integer is 0 to 1; 16 bits are rounded to 8.
template <class To, class From>
To convertedSample(From sample) {
    constexpr auto kMost = std::numeric_limits<From>::max();
    if constexpr (std::is_same_v<To, From>) {
        return sample;
    } else if constexpr (std::is_floating_point_v<To>) {
        return static_cast<To>(sample) * (To(1) / To(kMost));  // not a quotient: another last bit
    } else {
        constexpr unsigned kStep = kMost / std::numeric_limits<To>::max();
        return static_cast<To>((sample + kStep / 2) / kStep);
    }
}

/// The channels [begin, end) of `pixels` pixels that have `channels` of them.
template <class To, class From>
void convertSamples(const From* from, std::size_t pixels, std::size_t channels, std::size_t begin,
                    std::size_t end, To* to) {
    if (begin == 0 && end == channels) {  // a loop that compilers know to be simple
        for (std::size_t i = 0; i < pixels * channels; ++i)
            to[i] = convertedSample<To>(from[i]);
        return;
    }
    for (std::size_t pixel = 0; pixel < pixels; ++pixel, from += channels)
        for (std::size_t c = begin; c < end; ++c)
            *to++ = convertedSample<To>(from[c]);
}

}  // namespace peeler
