// SPDX-License-Identifier: Apache-2.0
#include "core/scene/view.h"

#include <algorithm>
#include <cmath>

namespace peeler::inline v0 {
namespace {

/// Two directions are parallel if the sine of their angle is less than this.
constexpr double kParallel = 1e-7;

/// Returns `v` normalised; nullopt if its length is 0 or not finite. Divides by the largest
/// component first, because the squares of a tiny scene's values may underflow.
std::optional<glm::dvec3> normalized(const glm::dvec3& v) {
    const double largest = std::max({std::abs(v.x), std::abs(v.y), std::abs(v.z)});
    if (!(largest > 0) || !std::isfinite(largest)) return std::nullopt;
    return glm::normalize(v / largest);
}

}  // namespace

std::optional<glm::dmat4> lookAlong(const glm::dvec3& eye, const glm::dvec3& forward,
                                    const glm::dvec3& up) {
    const auto ahead = normalized(forward), upwards = normalized(up);
    if (!ahead || !upwards) return std::nullopt;
    const glm::dvec3 side = glm::cross(*ahead, *upwards);
    if (glm::length(side) < kParallel) return std::nullopt;
    glm::dvec3 right = glm::normalize(side);
    // If the directions are nearly parallel, rounding leaves the cross product not quite
    // perpendicular to them.
    constexpr double kSlanting = 1e-13;
    const double slant = glm::dot(right, *ahead);
    if (std::abs(slant) > kSlanting) right = glm::normalize(right - slant * *ahead);
    const glm::dvec3 above = glm::normalize(glm::cross(right, *ahead));
    return glm::dmat4(glm::dvec4(right, 0), glm::dvec4(above, 0), glm::dvec4(-*ahead, 0),
                      glm::dvec4(eye, 1));
}

std::optional<glm::dmat4> rigid(const glm::dmat4& world) {
    return lookAlong(glm::dvec3(world[3]), -glm::dvec3(world[2]), glm::dvec3(world[1]));
}

glm::dmat4 Projection::matrix(double u0, double v0, double u1, double v1) const {
    const double left = half_width * (2 * u0 - 1), right = half_width * (2 * u1 - 1);
    const double top = half_height * (1 - 2 * v0), bottom = half_height * (1 - 2 * v1);
    glm::dmat4 m(0);  // m[column][row]
    m[0][0] = 2 / (right - left);
    m[1][1] = 2 / (top - bottom);
    if (perspective) {
        m[2][0] = (right + left) / (right - left);
        m[2][1] = (top + bottom) / (top - bottom);
        m[2][3] = -1;
        const bool infinite = std::isinf(far);
        m[2][2] = infinite ? 0 : near / (far - near);
        m[3][2] = infinite ? near : near * far / (far - near);
    } else {
        m[3][0] = -(right + left) / (right - left);
        m[3][1] = -(top + bottom) / (top - bottom);
        m[2][2] = 1 / (far - near);
        m[3][2] = far / (far - near);
        m[3][3] = 1;
    }
    return m;
}

namespace {

/// Calls use(linear), where `linear` converts depth to camera Z. The conversion is chosen once for
/// many depths, so that compilers can vectorise the loop over them.
template <class Use>
auto withLinearZ(const Projection& projection, Use&& use) {
    const double n = projection.near, f = projection.far;
    if (!projection.perspective) return use([=](double depth) { return f - depth * (f - n); });
    if (std::isinf(f)) return use([=](double depth) { return n / depth; });
    return use([=](double depth) { return n * f / (depth * (f - n) + n); });
}

}  // namespace

double Projection::linearZ(double depth) const {
    return withLinearZ(*this, [&](auto&& linear) { return linear(depth); });
}

void Projection::toLinearZ(std::span<float> depths) const {
    withLinearZ(*this, [&](auto&& linear) {
        for (float& depth : depths)
            depth = static_cast<float>(linear(static_cast<double>(depth)));
    });
}

glm::dvec3 worldPosition(const View& view, double x, double y, double z) {
    if (view.rays) {
        const Ray ray = rayOf(view, {x, y});
        return ray.origin + z * ray.direction;
    }
    const Projection& projection = view.projection;
    const double scale = projection.perspective ? z : 1;
    const glm::dvec4 in_camera(projection.half_width * (2 * x / view.width - 1) * scale,
                               projection.half_height * (1 - 2 * y / view.height) * scale, -z, 1);
    return glm::dvec3(view.camera_to_world * in_camera);
}

}  // namespace peeler::inline v0

namespace peeler {

Ray rayOf(const View& view, const glm::dvec2& pixel) {
    if (!view.rays) {
        const glm::dvec3 origin = worldPosition(view, pixel.x, pixel.y, 0);
        return {origin, worldPosition(view, pixel.x, pixel.y, 1) - origin};
    }
    const Ray ray = view.rays->at(pixel);
    return {glm::dvec3(view.camera_to_world * glm::dvec4(ray.origin, 1)),
            glm::dmat3(view.camera_to_world) * ray.direction};
}

RayDifferentials differentialsOf(const View& view, const glm::dvec2& pixel) {
    if (view.rays) {
        const glm::dmat3 turn(view.camera_to_world);
        auto [per_x, per_y] = view.rays->differentials(pixel);
        for (Ray* const change : {&per_x, &per_y})
            *change = {turn * change->origin, turn * change->direction};
        return {per_x, per_y};
    }
    // The rays of pinholes and parallel rays are linear in the pixel coordinates.
    const Ray here = rayOf(view, pixel);
    const auto along = [&](const glm::dvec2& step) {
        const Ray next = rayOf(view, pixel + step);
        return Ray{next.origin - here.origin, next.direction - here.direction};
    };
    return {along({1, 0}), along({0, 1})};
}

double distanceFromRigid(const glm::dmat4& matrix) {
    const glm::dmat3 turn(matrix);
    const glm::dmat3 square = glm::transpose(turn) * turn;
    double off = std::abs(glm::determinant(turn) - 1);
    for (int i = 0; i < 3; ++i) {
        for (int j = 0; j < 3; ++j) {
            const double error = std::abs(square[i][j] - (i == j ? 1 : 0));
            if (!(error <= off) && !std::isnan(off)) off = error;
        }
    }
    return off;
}

}  // namespace peeler
