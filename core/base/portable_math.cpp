// SPDX-License-Identifier: Apache-2.0
#include "core/base/portable_math.h"

#include <array>
#include <cmath>

namespace peeler {
namespace {

// π/2 as a sum. The first two have 33 bits, so their products with a small integer are exact (Cody
// and Waite, Software Manual for the Elementary Functions, 1980).
constexpr double kQuarterHigh = 0x1.921fb544p+0, kQuarterMiddle = 0x1.0b4611a6p-34,
                 kQuarterLow = 0x1.3198a2e037073p-69;
// π/2 rounded, and the rest.
constexpr double kQuarterTurn = 0x1.921fb54442d18p+0, kQuarterRest = 0x1.1a62633145c07p-54;

/// Returns Σ coefficients[i] · x^i.
template <std::size_t Count>
double series(const std::array<double, Count>& coefficients, double x) {
    double sum = 0;
    for (std::size_t i = Count; i-- > 0;)
        sum = sum * x + coefficients[i];
    return sum;
}

/// Returns the coefficients ±1/(first)!, ∓1/(first + 2)!, … of a Taylor series.
template <std::size_t Count>
constexpr std::array<double, Count> factorials(int first, double sign) {
    std::array<double, Count> coefficients{};
    double factorial = 1;
    for (int i = 2; i <= first; ++i)
        factorial *= i;
    for (std::size_t i = 0; i < Count; ++i) {
        coefficients[i] = sign / factorial;
        sign = -sign;
        first += 2;
        factorial *= (first - 1.0) * first;
    }
    return coefficients;
}

// sin x = x + x³ (−1/3! + …) and cos x = 1 − x²/2 + x⁴ (1/4! − …). The rest of the series is below
// 1e-19 for |x| ≤ π/4.
constexpr auto kSine = factorials<8>(3, -1);
constexpr auto kCosine = factorials<8>(4, 1);

/// Returns the arc tangent of the ratio of two positive numbers, at most 1.
double arcTangent(double smaller, double larger) {
    // atan(t) = atan(c) + atan((t − c) / (1 + t c)), with the nearest c of 0, ¼, ½, ¾, 1.
    static constexpr std::array<double, 5> kArcs{0, 0x1.f5b75f92c80ddp-3, 0x1.dac670561bb4fp-2,
                                                 0x1.4978fa3269ee1p-1, 0x1.921fb54442d18p-1};
    // atan x = x + x³ (−1/3 + x²/5 − …); the rest is below 1e-18 for |x| ≤ 1/8.
    static constexpr std::array<double, 8> kArcTangent{-1.0 / 3,  1.0 / 5,  -1.0 / 7,  1.0 / 9,
                                                       -1.0 / 11, 1.0 / 13, -1.0 / 15, 1.0 / 17};
    const auto nearest = static_cast<std::size_t>((smaller / larger * 8 + 1) / 2);
    const double c = static_cast<double>(nearest) / 4;
    const double rest = (smaller - c * larger) / (larger + c * smaller);
    const double square = rest * rest;
    return kArcs[nearest] + (rest + rest * (square * series(kArcTangent, square)));
}

}  // namespace

SinCos portableSinCos(double angle) {
    const double turns = std::floor(angle * (1 / kQuarterTurn) + 0.5);
    // The angle less the turns, as a sum of two numbers.
    const double high = angle - turns * kQuarterHigh, middle = turns * kQuarterMiddle;
    const double difference = high - middle;
    const double low = ((high - difference) - middle) - turns * kQuarterLow;
    const double x = difference + low, rest = (difference - x) + low;
    const double square = x * x;
    const double sin = x + (x * (square * series(kSine, square)) + rest);
    const double half = 0.5 * square, one_less = 1 - half;
    const double cos = one_less + (((1 - one_less) - half) +
                                   (square * square * series(kCosine, square) - x * rest));
    switch (static_cast<int>(turns) & 3) {
        case 0:
            return {sin, cos};
        case 1:
            return {cos, -sin};
        case 2:
            return {-sin, -cos};
        default:
            return {-cos, sin};
    }
}

double portableTan(double angle) {
    const SinCos both = portableSinCos(angle);
    return both.sin / both.cos;
}

double portableAtan2(double y, double x) {
    const double across = std::abs(y), along = std::abs(x);
    if (across == 0 && along == 0) return 0;
    double angle = across <= along ? arcTangent(across, along)
                                   : kQuarterTurn - (arcTangent(along, across) - kQuarterRest);
    if (x < 0) angle = 2 * kQuarterTurn - (angle - 2 * kQuarterRest);
    return y < 0 ? -angle : angle;
}

}  // namespace peeler
