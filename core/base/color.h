// SPDX-License-Identifier: Apache-2.0
// Colour maths: the sRGB transfer function, both ways, and perceptual colour ramps.
#pragma once

#include <array>
#include <cmath>

namespace peeler {

/// Converts encoded sRGB to linear, 0 to 1 (IEC 61966-2-1). T is the type to calculate in.
template <class T>
T linearFromSrgb(T encoded) {
    if (encoded <= T(0.04045)) return encoded / T(12.92);
    return std::pow((encoded + T(0.055)) / T(1.055), T(2.4));
}

/// Converts linear to encoded sRGB, without clipping: the inverse of linearFromSrgb().
template <class T>
T srgbFromLinear(T linear) {
    if (linear <= T(0.0031308)) return linear * T(12.92);
    return T(1.055) * std::pow(linear, 1 / T(2.4)) - T(0.055);
}

/// Returns a colour of "Inferno" (N. Smith and S. van der Walt, matplotlib, CC0): black, purple,
/// red, yellow, perceptually uniform. Linear Rec. 709. `share` is clipped to 0–1; NaN counts as 0.
std::array<float, 3> inferno(float share);

/// Returns a colour between dark blue and cyan, distinct from all colours of inferno().
std::array<float, 3> blueToCyan(float share);

}  // namespace peeler
