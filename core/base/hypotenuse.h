// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <algorithm>
#include <cmath>

namespace peeler {

/// Returns √(a² + b²), with the same bits on every machine. std::hypot() of glibc uses fused
/// multiply-adds on arm64. This is its algorithm for other processors (Borges, "An Improved
/// Algorithm for hypot(a,b)", 2019), for numbers whose squares neither overflow nor underflow.
inline double hypotenuse(double a, double b) {
    const double x = std::max(std::abs(a), std::abs(b)), y = std::min(std::abs(a), std::abs(b));
    // Then y does not change the sum.
    if (y <= x * 0x1p-54) return x + y;
    const double h = std::sqrt(x * x + y * y);
    if (h <= 2 * y) {
        const double d = h - y;
        return h - (x * (2 * d - x) + (d - 2 * (x - y)) * d) / (2 * h);
    }
    const double d = h - x;
    return h - (2 * d * (x - 2 * y) + ((4 * d - y) * y + d * d)) / (2 * h);
}

}  // namespace peeler
