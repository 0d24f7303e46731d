// SPDX-License-Identifier: Apache-2.0
#include "core/scene/light_view.h"

#include <algorithm>
#include <cmath>

namespace peeler {
namespace {

constexpr double kViewMargin = 1.01;

/// From `low` to `high` along one axis of the light.
struct Extent {
    double low = 0, high = 0;

    double middle() const { return (low + high) / 2; }
    double half() const { return (high - low) / 2; }
};

void fitOrthographic(View& view, const Extent& right, const Extent& up, const Extent& backward) {
    // What has no width must still have a picture.
    const double largest = std::max({right.half(), up.half(), backward.half()});
    const double least = largest > 0 ? 1e-4 * largest : 0.5;
    Projection& projection = view.projection;
    projection.perspective = false;
    projection.half_width = kViewMargin * std::max(right.half(), least);
    projection.half_height = kViewMargin * std::max(up.half(), least);
    const double margin = (kViewMargin - 1) * std::max(2 * backward.half(), 2 * least);
    projection.near = margin;
    projection.far = 3 * margin + 2 * backward.half();
    const glm::dmat4 axes = view.camera_to_world;
    view.camera_to_world[3] +=
        axes[0] * right.middle() + axes[1] * up.middle() + axes[2] * (backward.high + 2 * margin);
}

}  // namespace

std::optional<View> lightView(const PlacedLight& light, const PosedScene& posed) {
    if (light.light.type == LightType::kPoint) return std::nullopt;
    View view;
    view.camera_name = "light:" + light.name;
    view.camera_to_world = light.to_world;
    Extent extents[3];
    for (int axis = 0; axis < 3; ++axis) {
        const glm::dvec3 origin(light.to_world[3]), direction(light.to_world[axis]);
        extents[axis] = {-posed.reach(origin, -direction), posed.reach(origin, direction)};
        if (!std::isfinite(extents[axis].half())) return std::nullopt;
    }
    if (light.light.type == LightType::kDirectional) {
        fitOrthographic(view, extents[0], extents[1], extents[2]);
        return view;
    }
    view.projection.half_width = view.projection.half_height =
        kViewMargin * std::tan(std::min(light.light.outer_cone, kWidestCone));
    const double farthest = -extents[2].low;  // behind the light if negative: it sees nothing then
    view.projection.near = 1e-5 * (farthest > 0 ? farthest : 1);
    return view;
}

}  // namespace peeler
