// SPDX-License-Identifier: Apache-2.0
// Colours of numbers: the sRGB transfer function, both ways, and perceptual ramps.
#pragma once

#include <array>
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

/// "Inferno" (N. Smith and S. van der Walt, matplotlib, CC0): black, purple, red, yellow, evenly
/// brighter to the eye. Linear Rec. 709. `share` is clipped to 0–1; NaN is 0.
std::array<float, 3> inferno(float share);

/// Dark blue to cyan: what must not be taken for a colour of the other ramp.
std::array<float, 3> blueToCyan(float share);

}  // namespace peeler
