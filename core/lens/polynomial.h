// SPDX-License-Identifier: Apache-2.0
// Polynomials of one variable, and their first root.
#pragma once

#include <optional>
#include <span>
#include <utility>
#include <vector>

namespace peeler {

/// Coefficients by power: c[0] + c[1] x + c[2] x² + …
using Polynomial = std::vector<double>;

/// Returns the value and the derivative.
std::pair<double, double> evaluate(std::span<const double> polynomial, double x);

Polynomial derivative(std::span<const double> polynomial);
Polynomial product(std::span<const double> a, std::span<const double> b);
/// Returns a + factor · b.
Polynomial sum(std::span<const double> a, std::span<const double> b, double factor = 1);

/// Returns the places in [from, to], ascending, at which the polynomial changes its sign, as
/// closely as doubles allow.
std::vector<double> signChanges(const Polynomial& polynomial, double from, double to);

}  // namespace peeler
