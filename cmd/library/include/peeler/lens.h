// SPDX-License-Identifier: Apache-2.0
// Lenses: the name of a model, and its coefficients.
#pragma once

#include <string>
#include <vector>

#pragma GCC visibility push(default)

namespace peeler::inline v0 {

/// A lens, by the name of its model ("opencv-fisheye") and the model's coefficients, in its order.
struct Lens {
    std::string model;
    std::vector<double> coefficients{};
    bool operator==(const Lens&) const = default;
};

}  // namespace peeler::inline v0

#pragma GCC visibility pop
