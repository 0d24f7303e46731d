// SPDX-License-Identifier: Apache-2.0
// Rectangles of pixels.
#pragma once

#include <algorithm>
#include <cstdint>

#pragma GCC visibility push(default)

namespace peeler::inline v0 {

/// A half-open rectangle [x0, x1) × [y0, y1) of pixels. The origin is the upper left corner of the
/// display window, and y points down (OpenEXR's convention).
struct Window {
    int x0 = 0, y0 = 0, x1 = 0, y1 = 0;

    int width() const { return std::max(0, x1 - x0); }
    int height() const { return std::max(0, y1 - y0); }
    bool empty() const { return x1 <= x0 || y1 <= y0; }
    std::uint64_t pixels() const {
        return static_cast<std::uint64_t>(width()) * static_cast<std::uint64_t>(height());
    }
    bool operator==(const Window&) const = default;
};

inline Window intersect(const Window& a, const Window& b) {
    return {std::max(a.x0, b.x0), std::max(a.y0, b.y0), std::min(a.x1, b.x1), std::min(a.y1, b.y1)};
}

/// Returns the bounding window of `a` and `b`. Ignores empty windows.
inline Window unite(const Window& a, const Window& b) {
    if (a.empty()) return b;
    if (b.empty()) return a;
    return {std::min(a.x0, b.x0), std::min(a.y0, b.y0), std::max(a.x1, b.x1), std::max(a.y1, b.y1)};
}

}  // namespace peeler::inline v0

#pragma GCC visibility pop
