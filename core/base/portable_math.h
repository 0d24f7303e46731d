// SPDX-License-Identifier: Apache-2.0
// Trigonometric functions with the same bits on every machine.
#pragma once

namespace peeler {

// The C library's sin, cos and atan may differ in the last bit between libraries and their
// versions. These functions use only additions, multiplications, divisions and comparisons, which
// IEEE 754 defines to the bit (the build uses no fused multiply-adds). Their errors are below 1
// unit in the last place for sines and cosines, and below 2 for the others.

struct SinCos {
    double sin, cos;
};

/// Returns the sine and the cosine of an angle between −1e5 and 1e5 (radians).
SinCos portableSinCos(double angle);

/// Returns the tangent of an angle between −1e5 and 1e5 (radians).
double portableTan(double angle);

/// Returns the angle of the point (x, y) from the +X axis, from −π to π, as std::atan2; 0 for the
/// origin.
double portableAtan2(double y, double x);

}  // namespace peeler
