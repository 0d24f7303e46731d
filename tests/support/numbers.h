// SPDX-License-Identifier: Apache-2.0
// Constants that many tests use.
#pragma once

#include <limits>
#include <numbers>

namespace peeler::test {

inline constexpr double kPi = std::numbers::pi;
inline constexpr double kInfinity = std::numeric_limits<double>::infinity();
inline constexpr float kFloatInfinity = std::numeric_limits<float>::infinity();

}  // namespace peeler::test
