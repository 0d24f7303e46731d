// SPDX-License-Identifier: Apache-2.0
#include "core/lens/lens_rays.h"

#include <peeler/error.h>
#include "core/base/portable_math.h"

namespace peeler {
namespace {

/// Converts between OpenCV's camera axes and glTF's.
glm::dvec3 turned(const glm::dvec3& v) {
    return {v.x, 0 - v.y, 0 - v.z};  // 0 − x instead of −x, to avoid −0
}

}  // namespace

LensRays::LensRays(const Lens& lens, const Intrinsics& intrinsics, const Size& size)
    : intrinsics_(intrinsics) {
    if (size.width < 1 || size.height < 1)
        throw Error(ErrorKind::kUsage, "a lens needs the size of its picture", lens.model,
                    "give " + Parameter::kSize + " WxH");
    const LensModel& model = lensModel(lens);
    shape_ = model.shape(lens.coefficients, size);
    if (model.filling) intrinsics_ = model.filling(size);
}

std::optional<glm::dvec2> LensRays::pixel(const glm::dvec3& direction) const {
    const auto plane = shape_->plane(turned(direction));
    if (!plane) return {};
    const auto& [fx, fy, cx, cy] = intrinsics_;
    return glm::dvec2(plane->x * fx + cx + 0.5, plane->y * fy + cy + 0.5);
}

std::optional<LensRay> LensRays::ray(const glm::dvec2& pixel) const {
    const auto& [fx, fy, cx, cy] = intrinsics_;
    const auto ray = shape_->ray({(pixel.x - 0.5 - cx) / fx, (pixel.y - 0.5 - cy) / fy});
    if (!ray) return {};
    return LensRay{turned(ray->direction), turned(ray->per_x) / fx, turned(ray->per_y) / fy};
}

std::vector<glm::dvec3> LensRays::directions(const Window& window, const glm::dvec2& sample) const {
    const auto& [fx, fy, cx, cy] = intrinsics_;
    std::vector<double> columns, rows;
    for (int x = window.x0; x < window.x1; ++x)
        columns.push_back((x + sample.x - 0.5 - cx) / fx);
    for (int y = window.y0; y < window.y1; ++y)
        rows.push_back((y + sample.y - 0.5 - cy) / fy);
    std::vector<glm::dvec3> directions(window.pixels());
    shape_->fill(columns, rows, directions);
    for (glm::dvec3& direction : directions)
        direction = turned(direction);
    return directions;
}

Intrinsics intrinsicsOfAngle(const Lens& lens, double angle, const Size& size) {
    const LensModel& model = lensModel(lens);
    if (model.in_pixels || model.filling)
        throw Error(ErrorKind::kUsage, "a lens " + lens.model + " has no focal length to choose",
                    lens.model, "leave " + Parameter::kFov + " out");
    const auto [sin, cos] = portableSinCos(angle);
    const auto plane = model.shape(lens.coefficients, size)->plane({0, sin, cos});
    if (!plane || !(plane->y > 0))
        throw Error(ErrorKind::kUsage, "the lens does not see this field of view", lens.model,
                    "give a smaller " + Parameter::kFov + ", or " + Parameter::kIntrinsics);
    const double f = size.height / (2 * plane->y);
    return {f, f, (size.width - 1) / 2.0, (size.height - 1) / 2.0};
}

}  // namespace peeler
