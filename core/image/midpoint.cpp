// SPDX-License-Identifier: Apache-2.0
#include "core/image/midpoint.h"

#include <limits>

#include "core/base/parallel.h"

namespace peeler {
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

}  // namespace peeler
