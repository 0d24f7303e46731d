// SPDX-License-Identifier: Apache-2.0
// The sRGB transfer function, both ways.
#pragma once

#include <cmath>

namespace peeler {

/// Encoded to linear, 0 to 1 (IEC 61966-2-1). T is the type to calculate in.
template <class T>
T linearFromSrgb(T encoded) {
    if (encoded <= T(0.04045)) return encoded / T(12.92);
    return std::pow((encoded + T(0.055)) / T(1.055), T(2.4));
}

/// Linear to encoded, the inverse; not clipped.
template <class T>
T srgbFromLinear(T linear) {
    if (linear <= T(0.0031308)) return linear * T(12.92);
    return T(1.055) * std::pow(linear, 1 / T(2.4)) - T(0.055);
}

}  // namespace peeler
