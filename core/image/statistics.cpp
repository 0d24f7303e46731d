// SPDX-License-Identifier: Apache-2.0
#include "core/image/statistics.h"

#include <algorithm>
#include <cmath>
#include <cstddef>
#include <limits>
#include <vector>

#include "core/base/parallel.h"

namespace peeler {
namespace {

std::vector<float> firstDepths(const LayeredImage& image, const Window& window) {
    std::vector<float> depths;
    for (int y = window.y0; y < window.y1; ++y) {
        for (int x = window.x0; x < window.x1; ++x) {
            const std::size_t pixel = image.pixelIndex(x, y);
            if (image.count(pixel) > 0) depths.push_back(image.z[image.offsets[pixel]]);
        }
    }
    return depths;
}

}  // namespace

std::optional<double> medianDepth(const LayeredImage& image, const View& view) {
    const Window middle{view.width / 3, view.height / 3, view.width - view.width / 3,
                        view.height - view.height / 3};
    std::vector<float> depths = firstDepths(image, intersect(middle, image.window));
    if (depths.empty()) depths = firstDepths(image, image.window);
    if (depths.empty()) return {};
    const auto median = depths.begin() + static_cast<std::ptrdiff_t>(depths.size() / 2);
    std::nth_element(depths.begin(), median, depths.end());
    return *median;
}

namespace {

constexpr double kDepthRounding = 1.0 / (1 << 18);

float midpoint(std::span<const float> z, const Projection& projection) {
    if (z.empty()) return std::numeric_limits<float>::infinity();
    const double nearest = static_cast<double>(z[0]);
    const double scale = projection.perspective ? nearest : projection.far - projection.near;
    for (const float next : z.subspan(1)) {
        const double depth = static_cast<double>(next);
        if (depth - nearest > kDepthRounding * scale)
            return static_cast<float>((nearest + depth) / 2);
    }
    return std::numeric_limits<float>::infinity();
}

}  // namespace

void midpoints(const LayeredImage& image, const Projection& projection, std::span<float> out) {
    const auto width = static_cast<std::size_t>(image.window.width());
    parallelFor(static_cast<std::size_t>(image.window.height()), [&](std::size_t row) {
        for (std::size_t p = row * width; p < (row + 1) * width; ++p)
            out[p] =
                midpoint(std::span(image.z).subspan(image.offsets[p], image.count(p)), projection);
    });
}

void PointStatistics::add(const glm::dvec3& point) {
    ++points;
    least = glm::min(least, point);
    largest = glm::max(largest, point);
    sum += point;
}

glm::dvec3 PointStatistics::tidy(glm::dvec3 v) const {
    const double smallest = 1e-9 * glm::length(largest - least);
    for (int i = 0; i < 3; ++i) {
        if (std::abs(v[i]) <= smallest) v[i] = 0;  // −0 becomes 0, too
    }
    return v;
}

void addPoints(const View& view, const LayeredImage& band, PointStatistics& statistics) {
    std::size_t pixel = 0;
    for (int y = band.window.y0; y < band.window.y1; ++y) {
        for (int x = band.window.x0; x < band.window.x1; ++x, ++pixel) {
            for (std::uint32_t f = band.offsets[pixel]; f < band.offsets[pixel + 1]; ++f)
                statistics.add(
                    worldPosition(view, x + view.sample.x, y + view.sample.y, band.z[f]));
        }
    }
}

}  // namespace peeler
