// SPDX-License-Identifier: Apache-2.0
#include "core/image/point_statistics.h"

#include <cmath>

namespace peeler {

void PointStatistics::add(const glm::dvec3& point) {
    ++points;
    least = glm::min(least, point);
    largest = glm::max(largest, point);
    sum += point;
}

glm::dvec3 PointStatistics::tidy(glm::dvec3 v) const {
    const double smallest = 1e-9 * glm::length(largest - least);
    for (int i = 0; i < 3; ++i) {
        if (std::abs(v[i]) <= smallest) v[i] = 0;  // −0 as well
    }
    return v;
}

void addPoints(const View& view, const LayeredImage& band, PointStatistics& statistics) {
    std::size_t pixel = 0;
    for (int y = band.window.y0; y < band.window.y1; ++y) {
        for (int x = band.window.x0; x < band.window.x1; ++x, ++pixel) {
            for (std::uint32_t f = band.offsets[pixel]; f < band.offsets[pixel + 1]; ++f)
                statistics.add(worldPosition(view, x + 0.5, y + 0.5, band.z[f]));
        }
    }
}

}  // namespace peeler
