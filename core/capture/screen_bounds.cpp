// SPDX-License-Identifier: Apache-2.0
#include "core/capture/screen_bounds.h"

#include <algorithm>
#include <cmath>

namespace peeler {
namespace {

constexpr double kPixelMargin =
    2;  // pixels: lines and points have a width, coordinates are snapped

/// What a clip coordinate may be off: four products of matrix entries and coordinates, each rounded
/// to float, and summed.
constexpr double kClipRounding = 8.0 / (1 << 24);

}  // namespace

void Box::add(std::span<const glm::vec3> points) {
    for (const glm::vec3& point : points) {
        min = glm::min(min, point);
        max = glm::max(max, point);
    }
}

Window screenBounds(const Box& box, const glm::dmat4& clip_from_model, int width, int height) {
    const Window all{0, 0, width, height};
    if (box.empty()) return {};
    glm::dmat4 sizes;
    for (int i = 0; i < 4; ++i)
        sizes[i] = glm::abs(clip_from_model[i]);
    const glm::dvec2 size(width, height);
    glm::dvec2 low(std::numeric_limits<double>::infinity()), high = -low;
    for (int corner = 0; corner < 8; ++corner) {
        const glm::dvec4 point((corner & 1) ? box.max.x : box.min.x,
                               (corner & 2) ? box.max.y : box.min.y,
                               (corner & 4) ? box.max.z : box.min.z, 1);
        const glm::dvec4 clip = clip_from_model * point;
        const glm::dvec4 error = kClipRounding * (sizes * glm::abs(point));
        const double least_w = clip.w - error.w;
        if (!(least_w > 0)) return all;
        const glm::dvec2 ndc = glm::dvec2(clip) / clip.w;
        const glm::dvec2 off = (glm::dvec2(error) + glm::abs(ndc) * error.w) / least_w;
        low = glm::min(low, (ndc - off + 1.0) / 2.0 * size - kPixelMargin);
        high = glm::max(high, (ndc + off + 1.0) / 2.0 * size + kPixelMargin);
    }
    // Also where something is not finite.
    if (!(low.x <= high.x && low.y <= high.y)) return all;
    low = glm::clamp(glm::floor(low), glm::dvec2(0), size);
    high = glm::clamp(glm::ceil(high), glm::dvec2(0), size);
    return {static_cast<int>(low.x), static_cast<int>(low.y), static_cast<int>(high.x),
            static_cast<int>(high.y)};
}

}  // namespace peeler
