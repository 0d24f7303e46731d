// SPDX-License-Identifier: Apache-2.0
#include "core/trace/exact_ray.h"

#include <algorithm>
#include <cmath>
#include <limits>

namespace peeler {
namespace {

/// An unsigned integer of 320 bits, lowest digit first.
using Digits = std::array<std::uint64_t, 5>;

Digits digitsOf(const WideSum& value) {
    const auto high = static_cast<unsigned __int128>(value.high);
    constexpr int kBits = WideSum::kLowBits;
    return {static_cast<std::uint64_t>(high << kBits) | value.low,
            static_cast<std::uint64_t>(high >> (64 - kBits)),
            static_cast<std::uint64_t>(high >> (128 - kBits)), 0, 0};
}

Digits product(const Digits& value, std::uint32_t factor) {
    Digits result{};
    unsigned __int128 carry = 0;
    for (std::size_t i = 0; i < value.size(); ++i) {
        carry += static_cast<unsigned __int128>(value[i]) * factor;
        result[i] = static_cast<std::uint64_t>(carry);
        carry >>= 64;
    }
    return result;
}

Digits shifted(const Digits& value, int bits) {
    Digits result{};
    const auto whole = static_cast<std::size_t>(bits / 64);
    const int part = bits % 64;
    for (std::size_t i = whole; i < value.size(); ++i) {
        result[i] = value[i - whole] << part;
        if (part > 0 && i > whole) result[i] |= value[i - whole - 1] >> (64 - part);
    }
    return result;
}

/// Returns the sign of a − b.
int compared(const Digits& a, const Digits& b) {
    for (std::size_t i = a.size(); i-- > 0;)
        if (a[i] != b[i]) return a[i] < b[i] ? -1 : 1;
    return 0;
}

/// Returns the exponent of a positive number: std::ilogb().
int exponentOf(double value) {
    if (!std::isnormal(value)) return std::ilogb(value);
    return static_cast<int>(std::bit_cast<std::uint64_t>(value) >> 52) - 1023;
}

double toDouble(Wide positive) {
    return static_cast<double>(static_cast<std::uint64_t>(positive >> 64)) * 0x1p64 +
           static_cast<double>(static_cast<std::uint64_t>(positive));
}

}  // namespace

double powerOfTwo(int exponent) {
    if (exponent < -1022 || exponent > 1023) return std::ldexp(1.0, exponent);
    return std::bit_cast<double>(static_cast<std::uint64_t>(exponent + 1023) << 52);
}

double toDouble(const WideSum& value) {
    return toDouble(value.high) * 0x1p56 + static_cast<double>(value.low);
}

float roundedQuotient(const WideSum& numerator, const WideSum& denominator, int exponent) {
    constexpr float kMost = std::numeric_limits<float>::max();
    // The relative error of the quotient is less than 2^-49.
    const double quotient = toDouble(numerator) / toDouble(denominator) * powerOfTwo(exponent);
    if (!(quotient < double{kMost})) return kMost;
    const auto nearest = static_cast<float>(quotient);
    const auto least = static_cast<float>(quotient * (1 - 0x1p-48));
    const auto most = static_cast<float>(quotient * (1 + 0x1p-48));
    if (least == most || quotient < double{std::numeric_limits<float>::min()}) return nearest;
    // The quotient is close to the middle of two floats, which has a significand of 25 bits.
    const double middle = 0.5 * (double{least} + double{most});
    int middle_exponent = 0;
    const auto significand =
        static_cast<std::uint32_t>(std::ldexp(std::frexp(middle, &middle_exponent), 25));
    const int shift = exponent - (middle_exponent - 25);
    const Digits left = shifted(digitsOf(numerator), std::max(shift, 0));
    const Digits right = shifted(product(digitsOf(denominator), significand), std::max(-shift, 0));
    const int side = compared(left, right);
    if (side != 0) return side < 0 ? least : most;
    return std::bit_cast<std::uint32_t>(least) % 2 == 0 ? least : most;
}

std::optional<ExactRay> ExactRay::make(const CellGrid& grid, const glm::dvec3& origin,
                                       const glm::dvec3& direction) {
    constexpr double kFarthest = 0x1p60, kScene = 0x1p51;
    static_assert(CellGrid::kOriginBits == 60 && CellGrid::kVertexBits == 50);
    glm::dvec3 at = grid.position(origin);
    const double most =
        std::max({std::abs(direction.x), std::abs(direction.y), std::abs(direction.z)});
    if (!std::isfinite(at.x) || !std::isfinite(at.y) || !std::isfinite(at.z) ||
        !std::isfinite(direction.x + direction.y + direction.z) || !(most > 0))
        return std::nullopt;
    ExactRay ray;
    // The largest component becomes a number from 2^51 up to 2^52.
    const int scale = CellGrid::kDirectionBits - 1 - exponentOf(most);
    const double factor = powerOfTwo(scale);
    glm::dvec3 along = direction * factor;
    if (!std::isfinite(factor))
        along = {std::ldexp(direction.x, scale), std::ldexp(direction.y, scale),
                 std::ldexp(direction.z, scale)};
    ray.direction = rounded(along);
    ray.exponent = grid.exponent() + scale;
    const double farthest = std::max({std::abs(at.x), std::abs(at.y), std::abs(at.z)});
    if (farthest > kFarthest) {
        // Begins where the ray has entered the slabs of twice the scene's size along all axes.
        double enter = 0;
        int last = 0;
        for (int i = 0; i < 3; ++i) {
            const double gap = std::abs(at[i]) - kScene;
            if (gap <= 0) continue;
            if (at[i] * along[i] >= 0) return std::nullopt;  // leads away
            if (gap / std::abs(along[i]) < enter) continue;
            enter = gap / std::abs(along[i]);
            last = i;
        }
        const double side = std::copysign(kScene, at[last]);
        at += enter * along;
        at[last] = side;
        if (!(std::max({std::abs(at.x), std::abs(at.y), std::abs(at.z)}) <= kFarthest))
            return std::nullopt;  // passes the scene
        ray.start = std::ldexp(enter, ray.exponent);
    }
    ray.origin = rounded(at);
    return ray;
}

float hitT(const ExactRay& ray, const WideSum& distance, const WideSum& along) {
    const float t = roundedQuotient(distance, along, ray.exponent);
    return ray.start == 0 ? t : static_cast<float>(ray.start + double{t});
}

std::optional<ExactHit> exactHit(const ExactRay& ray, const CellCorners& corners, bool inside) {
    const auto& [a, b, c] = corners;
    if (!inside) {
        const int side = edgeSide(ray, a, b);
        if (side == 0 || edgeSide(ray, b, c) != side || edgeSide(ray, c, a) != side)
            return std::nullopt;
    }
    const std::array<Wide, 3> normal = crossOf(b - a, c - a);
    // Never 0: it is the sum of the three determinants of edgeSide(), also with a moved origin.
    const WideSum along = dotOf(normal, ray.direction);
    const WideSum distance = dotOf(normal, a - ray.origin);
    const int side = along.sign();
    if (aheadOf(distance, normal) != side) return std::nullopt;
    return ExactHit{hitT(ray, distance.magnitude(), along.magnitude()), side > 0};
}

std::array<double, 3> exactWeights(const ExactRay& ray, const CellCorners& corners) {
    std::array<double, 3> weights{};
    const double sum =
        toDouble(dotOf(crossOf(corners[1] - corners[0], corners[2] - corners[0]), ray.direction)
                     .magnitude());
    for (std::size_t i = 0; i < 3; ++i) {
        const Cells& from = corners[(i + 1) % 3];
        const Cells& to = corners[(i + 2) % 3];
        const WideSum part = dotOf(crossOf(from - ray.origin, to - from), ray.direction);
        weights[i] = std::min(toDouble(part.magnitude()) / sum, 1.0);
    }
    return weights;
}

}  // namespace peeler
