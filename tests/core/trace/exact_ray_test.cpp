// SPDX-License-Identifier: Apache-2.0
// Tests the exact arithmetic of rays: wide sums, sides of edges, quotients rounded to floats.
#include <gtest/gtest.h>

#include <cmath>
#include <random>

#include "core/trace/exact_ray.h"

namespace peeler::test {
namespace {

/// Returns a random number with a random number of bits, at most `bits`.
std::int64_t anyNumber(std::mt19937_64& random, int bits) {
    const auto value = static_cast<std::int64_t>(random() >> 1);
    const auto used = 1 + static_cast<int>(random() % static_cast<unsigned>(bits));
    return (value >> (63 - used)) * (random() % 2 == 0 ? 1 : -1);
}

Cells anyCells(std::mt19937_64& random, int bits) {
    return {anyNumber(random, bits), anyNumber(random, bits), anyNumber(random, bits)};
}

/// Returns a − b modulo 2^64, as a number near 0.
std::int64_t differenceOf(std::uint64_t a, std::uint64_t b) {
    return static_cast<std::int64_t>(a - b);
}

TEST(ExactRay, DotProductsAreExact) {
    // The sum is right modulo 2^56, and nearly right in floating point. Both together leave one
    // value only where the sum is small; so the sums are also compared with a regrouped one.
    std::mt19937_64 random(1);
    for (int i = 0; i < 100'000; ++i) {
        const Cells a = anyCells(random, 61), b = anyCells(random, 51), d = anyCells(random, 52);
        const WideSum sum = dotOf(crossOf(a, b), d);
        std::uint64_t modular = 0;
        long double about = 0, size = 0;
        for (std::size_t k = 0; k < 3; ++k) {
            const std::size_t l = (k + 1) % 3, m = (k + 2) % 3;
            const auto u = [](std::int64_t v) { return static_cast<std::uint64_t>(v); };
            modular += (u(a[l]) * u(b[m]) - u(a[m]) * u(b[l])) * u(d[k]);
            const auto f = [](std::int64_t v) { return static_cast<long double>(v); };
            about += (f(a[l]) * f(b[m]) - f(a[m]) * f(b[l])) * f(d[k]);
            size += (std::abs(f(a[l]) * f(b[m])) + std::abs(f(a[m]) * f(b[l]))) * std::abs(f(d[k]));
        }
        EXPECT_EQ(sum.low, modular & ((std::uint64_t{1} << 56) - 1));
        EXPECT_EQ(differenceOf(static_cast<std::uint64_t>(sum.high) << 56 | sum.low, modular), 0);
        const long double value =
            static_cast<long double>(sum.high) * 0x1p56L + static_cast<long double>(sum.low);
        EXPECT_LE(std::abs(value - about), size * 0x1p-60L);
        EXPECT_EQ(sum.sign(), value < 0 ? -1 : value > 0 ? 1 : 0);
        const double magnitude = toDouble(sum.magnitude());
        EXPECT_LE(std::abs(static_cast<long double>(magnitude) - std::abs(value)),
                  std::abs(value) * 0x1p-51L);
    }
}

TEST(ExactRay, SidesOfEdgesAreAntisymmetricAndNeverUndecided) {
    // Rays through points of the edges, so that most determinants are 0 or tiny.
    std::mt19937_64 random(2);
    int zeros = 0;
    for (int i = 0; i < 100'000; ++i) {
        const int bits = 4 + static_cast<int>(random() % 46);
        const Cells a = anyCells(random, bits), b = anyCells(random, bits);
        ExactRay ray;
        ray.direction = anyCells(random, 48);
        const std::int64_t steps = anyNumber(random, 10);
        for (std::size_t k = 0; k < 3; ++k) {
            const std::int64_t target = random() % 4 == 0 ? a[k] : (a[k] + b[k]) / 2;
            ray.origin[k] = target - steps * ray.direction[k];
        }
        const int side = edgeSide(ray, a, b);
        EXPECT_EQ(edgeSide(ray, b, a), -side);
        const auto parallel = crossOf(b - a, ray.direction);
        EXPECT_EQ(side == 0, parallel[0] == 0 && parallel[1] == 0 && parallel[2] == 0);
        zeros += dotOf(crossOf(a - ray.origin, b - a), ray.direction).sign() == 0 ? 1 : 0;
    }
    EXPECT_GT(zeros, 1000);
}

/// Returns value · 2^power, for a value below 2^60.
WideSum wideSum(std::uint64_t value, int power) {
    const int low = std::min(power, WideSum::kLowBits);
    const Wide shifted = Wide{static_cast<std::int64_t>(value)} << low;
    constexpr std::uint64_t kMask = (std::uint64_t{1} << WideSum::kLowBits) - 1;
    return {(shifted >> WideSum::kLowBits) << (power - low),
            static_cast<std::uint64_t>(shifted) & kMask};
}

TEST(ExactRay, QuotientsAreRoundedOnce) {
    std::mt19937_64 random(3);
    for (int i = 0; i < 20'000; ++i) {
        // (2m + 1) / 2 lies in the middle of two floats.
        const std::uint64_t m = (std::uint64_t{1} << 23) + random() % (1U << 23);
        const std::uint64_t denominator = 1 + random() % (1U << 30);
        const auto even = static_cast<float>(m % 2 == 0 ? m : m + 1);
        const auto below = static_cast<float>(m), above = static_cast<float>(m + 1);
        const std::uint64_t numerator = (2 * m + 1) * denominator;
        for (const int power : {0, 5, 50}) {
            EXPECT_EQ(roundedQuotient(wideSum(numerator, power), wideSum(denominator, power), -1),
                      even);
            EXPECT_EQ(
                roundedQuotient(wideSum(numerator, power), wideSum(denominator, 0), -1 - power),
                even);
            EXPECT_EQ(
                roundedQuotient(wideSum(numerator, 0), wideSum(denominator, power), power - 1),
                even);
        }
        WideSum more = wideSum(numerator, 50), less = more;
        const WideSum by = wideSum(denominator, 50);
        // The smallest steps, far below the precision of a double.
        more.low += more.low + 1 < (std::uint64_t{1} << 56) ? 1 : 0;
        if (less.low == 0) {
            less.low = (std::uint64_t{1} << 56) - 1;
            --less.high;
        } else {
            --less.low;
        }
        EXPECT_EQ(roundedQuotient(more, by, -1), above);
        EXPECT_EQ(roundedQuotient(less, by, -1), below);
    }
    EXPECT_EQ(roundedQuotient({}, wideSum(3, 0), 0), 0);
    EXPECT_EQ(roundedQuotient(wideSum(3, 0), wideSum(1, 0), 500),
              std::numeric_limits<float>::max());
}

TEST(CellGrid, KeepsFloatsAndRoundsFinely) {
    std::mt19937 random(4);
    std::uniform_real_distribution<float> number(-1, 1);
    for (const float far : {0.0F, 4.0F, 1000.0F, -3e6F}) {
        Bounds box{glm::dvec3(double{far} - 1), glm::dvec3(double{far} + 1)};
        const CellGrid grid(box);
        EXPECT_LE(grid.cell(), 2 * 0x1p-49);
        for (int i = 0; i < 1000; ++i) {
            const glm::dvec3 point(double{far} + double{number(random)},
                                   double{far + number(random)}, double{far});
            const glm::dvec3 position = grid.position(point);
            for (int axis = 0; axis < 3; ++axis)
                EXPECT_LE(std::abs(position[axis]), 0x1p50);
            // Floats of more than 2^-26 of the extent are whole numbers of cells.
            const double y = grid.position(glm::dvec3(double{static_cast<float>(point.y)})).y;
            EXPECT_EQ(y, std::rint(y));
        }
    }
}

}  // namespace
}  // namespace peeler::test
