// SPDX-License-Identifier: Apache-2.0
#include "core/scene/frustum.h"

#include <array>
#include <cmath>

namespace peeler {

namespace {

/// The half-space of the points p in world space with dot(inward, p - eye) >= offset.
struct FrustumPlane {
    FrustumSide side;
    glm::dvec3 inward;
    double offset;
};

std::array<FrustumPlane, 6> planesOf(const View& view) {
    const Projection& projection = view.projection;
    const glm::dmat3 to_world(view.camera_to_world);
    const double x0 = (2.0 * view.crop.x0 / view.width - 1) * projection.half_width;
    const double x1 = (2.0 * view.crop.x1 / view.width - 1) * projection.half_width;
    const double y0 = (1 - 2.0 * view.crop.y1 / view.height) * projection.half_height;
    const double y1 = (1 - 2.0 * view.crop.y0 / view.height) * projection.half_height;
    // The sides pass through the eye of a perspective camera; an orthographic camera's sides are
    // parallel.
    const auto side = [&](FrustumSide which, const glm::dvec3& axis, double at) {
        return projection.perspective
                   ? FrustumPlane{which, to_world * (axis + glm::dvec3(0, 0, at)), 0}
                   : FrustumPlane{which, to_world * axis, at};
    };
    return {{{FrustumSide::kNear, to_world * glm::dvec3(0, 0, -1), projection.near},
             {FrustumSide::kFar, to_world * glm::dvec3(0, 0, 1), -projection.far},
             side(FrustumSide::kLeft, {1, 0, 0}, x0),
             side(FrustumSide::kRight, {-1, 0, 0}, -x1),
             side(FrustumSide::kBottom, {0, 1, 0}, y0),
             side(FrustumSide::kTop, {0, -1, 0}, -y1)}};
}

}  // namespace

std::optional<FrustumSide> sideBeyondWhich(const View& view, const SceneExtent& extent) {
    const glm::dvec3 eye(view.camera_to_world[3]);
    for (const FrustumPlane& plane : planesOf(view))
        if (extent.reach(eye, plane.inward) < plane.offset) return plane.side;
    return std::nullopt;
}

bool cutsOff(const View& view, const SceneExtent& extent) {
    const Bounds bounds = extent.bounds();
    const glm::dvec3 eye(view.camera_to_world[3]), middle = (bounds.min + bounds.max) * 0.5;
    const glm::dvec3 half = (bounds.max - bounds.min) * 0.5;
    const double rounding = 1e-6 * sceneSize(bounds);
    for (const FrustumPlane& plane : planesOf(view)) {
        if (std::isinf(plane.offset)) continue;
        // Testing the bounds is faster than testing the vertices, and often decides.
        const double nearest =
            glm::dot(middle - eye, plane.inward) - glm::dot(half, glm::abs(plane.inward));
        if (nearest >= plane.offset - rounding) continue;
        if (-extent.reach(eye, -plane.inward) < plane.offset - rounding) return true;
    }
    return false;
}

}  // namespace peeler
