// SPDX-License-Identifier: Apache-2.0
#include "core/lens/polynomial.h"

#include <algorithm>

namespace peeler {

std::pair<double, double> evaluate(std::span<const double> polynomial, double x) {
    double value = 0, slope = 0;
    for (std::size_t i = polynomial.size(); i-- > 0;) {
        slope = slope * x + value;
        value = value * x + polynomial[i];
    }
    return {value, slope};
}

Polynomial derivative(std::span<const double> polynomial) {
    Polynomial result;
    for (std::size_t i = 1; i < polynomial.size(); ++i)
        result.push_back(polynomial[i] * static_cast<double>(i));
    return result;
}

Polynomial product(std::span<const double> a, std::span<const double> b) {
    Polynomial result(a.size() + b.size() - 1);
    for (std::size_t i = 0; i < a.size(); ++i)
        for (std::size_t j = 0; j < b.size(); ++j)
            result[i + j] += a[i] * b[j];
    return result;
}

Polynomial sum(std::span<const double> a, std::span<const double> b, double factor) {
    Polynomial result(std::max(a.size(), b.size()));
    for (std::size_t i = 0; i < a.size(); ++i)
        result[i] += a[i];
    for (std::size_t i = 0; i < b.size(); ++i)
        result[i] += factor * b[i];
    return result;
}

std::vector<double> signChanges(const Polynomial& polynomial, double from, double to) {
    if (std::ranges::all_of(polynomial, [](double c) { return c == 0; })) return {};
    // Between the sign changes of its derivative, a polynomial is monotone.
    std::vector<double> ends = signChanges(derivative(polynomial), from, to);
    ends.insert(ends.begin(), from);
    ends.push_back(to);
    const auto negative = [&](double x) { return evaluate(polynomial, x).first < 0; };
    std::vector<double> found;
    for (std::size_t i = 0; i + 1 < ends.size(); ++i) {
        double low = ends[i], high = ends[i + 1];
        const bool sign = negative(low);
        if (negative(high) == sign) continue;
        for (double middle = low + (high - low) / 2; middle > low && middle < high;
             middle = low + (high - low) / 2)
            (negative(middle) == sign ? low : high) = middle;
        found.push_back(low);
    }
    return found;
}

}  // namespace peeler
