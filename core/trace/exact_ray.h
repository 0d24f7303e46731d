// SPDX-License-Identifier: Apache-2.0
// Intersections of rays and triangles in exact integer arithmetic (README.md).
#pragma once

#include <array>
#include <bit>
#include <cstdint>
#include <optional>

#include "core/base/lanes.h"
#include "core/trace/cell_grid.h"

namespace peeler {

__extension__ using Wide = __int128;

/// An integer of up to 185 bits: high · 2^kLowBits + low. `low` is never negative.
struct WideSum {
    static constexpr int kLowBits = 56;
    Wide high = 0;
    std::uint64_t low = 0;

    int sign() const { return high < 0 ? -1 : high > 0 || low > 0 ? 1 : 0; }
    WideSum magnitude() const {
        if (high >= 0) return *this;
        const std::uint64_t rest = low == 0 ? 0 : (std::uint64_t{1} << kLowBits) - low;
        return {-high - (low == 0 ? 0 : 1), rest};
    }
};

/// Returns a × b. Its components have at most one bit more than the products of the components.
PEELER_INLINE std::array<Wide, 3> crossOf(const Cells& a, const Cells& b) {
    return {Wide{a[1]} * b[2] - Wide{a[2]} * b[1], Wide{a[2]} * b[0] - Wide{a[0]} * b[2],
            Wide{a[0]} * b[1] - Wide{a[1]} * b[0]};
}

/// Returns n · v, for |n| < 2^118 and |v| < 2^62.
PEELER_INLINE WideSum dotOf(const std::array<Wide, 3>& n, const Cells& v) {
    constexpr std::int64_t kLow = (std::int64_t{1} << WideSum::kLowBits) - 1;
    Wide high = 0, low = 0;
    for (std::size_t i = 0; i < 3; ++i) {
        high += Wide{static_cast<std::int64_t>(n[i] >> WideSum::kLowBits)} * v[i];
        low += Wide{static_cast<std::int64_t>(n[i]) & kLow} * v[i];
    }
    return {high + (low >> WideSum::kLowBits), static_cast<std::uint64_t>(low) & kLow};
}

/// Returns 2^exponent; 0 or infinity beyond the doubles.
double powerOfTwo(int exponent);

/// Returns a non-negative number as a double, with a relative error of less than 2^-51.
double toDouble(const WideSum& value);

/// Returns the float nearest to numerator / denominator · 2^exponent (ties to even). Both numbers
/// are positive, or the numerator is 0. Numbers beyond the floats become the largest float.
float roundedQuotient(const WideSum& numerator, const WideSum& denominator, int exponent);

/// A ray on the grid. Points of the ray are origin + τ · direction, for τ >= 0. Symbolically, the
/// origin is moved by (ε, ε², ε³) for an infinitesimal ε > 0.
struct ExactRay {
    Cells origin{}, direction{};
    int exponent = 0;  ///< t = τ · 2^exponent + start
    double start = 0;  ///< t of the origin: 0 except for a ray that begins far from the scene

    /// Returns the ray from `origin` along `direction`, or nothing if a number is not finite or the
    /// direction is 0. Where the ray begins more than 2^kOriginBits cells away, it is cut off.
    static std::optional<ExactRay> make(const CellGrid& grid, const glm::dvec3& origin,
                                        const glm::dvec3& direction);
};

/// The corners of a triangle.
using CellCorners = std::array<Cells, 3>;

/// Returns the side of the moved ray's line on which the edge a–b passes: 1 or −1, or 0 if the edge
/// is parallel to the ray. The sign of det(a − origin, b − a, direction). Swapping a and b changes
/// the sign.
PEELER_INLINE int edgeSide(const ExactRay& ray, const Cells& a, const Cells& b) {
    const Cells edge = b - a;
    const int side = dotOf(crossOf(a - ray.origin, edge), ray.direction).sign();
    if (side != 0) return side;
    // Moving the origin by δ adds −δ · (edge × direction).
    for (const Wide part : crossOf(edge, ray.direction))
        if (part != 0) return part < 0 ? 1 : -1;
    return 0;
}

/// Returns on which side of a triangle's plane the moved origin is: 1 behind it, −1 in front of it,
/// where its corners are counter-clockwise. `distance`: normal · (corner − origin).
inline int aheadOf(const WideSum& distance, const std::array<Wide, 3>& normal) {
    if (const int sign = distance.sign(); sign != 0) return sign;
    for (const Wide part : normal)
        if (part != 0) return part < 0 ? 1 : -1;
    return 0;
}

/// Returns t of a hit, from the magnitudes of normal · (corner − origin) and normal · direction.
float hitT(const ExactRay& ray, const WideSum& distance, const WideSum& along);

/// A hit.
struct ExactHit {
    float t = 0;
    bool back = false;  ///< whether the corners are clockwise, seen from the origin
};

/// Returns the hit of a ray and a triangle, if there is one. `inside`: the ray's line is known to
/// pass through the triangle, away from its edges.
std::optional<ExactHit> exactHit(const ExactRay& ray, const CellCorners& corners, bool inside);

/// Returns the barycentric weights of a hit. Each is between 0 and 1, with an error of less than
/// 2^-49; they add up to 1 up to rounding.
std::array<double, 3> exactWeights(const ExactRay& ray, const CellCorners& corners);

}  // namespace peeler
