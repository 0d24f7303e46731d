// SPDX-License-Identifier: Apache-2.0
#include "core/scene/lights.h"

#include <algorithm>
#include <cmath>

#include <peeler/error.h>
#include <peeler/view.h>
#include "shaders/interface.glsl"

namespace peeler {
namespace {

/// Returns a light's placement as a rigid matrix. The node's matrix may lack a roll and, for point
/// lights, a direction.
glm::dmat4 place(const LightInstance& instance, LightType type) {
    const glm::dmat4& world = instance.world;
    const glm::dvec3 at(world[3]), forward = -glm::dvec3(world[2]);
    if (std::isfinite(glm::length(at))) {
        if (const auto turned = rigid(world)) return *turned;
        for (const glm::dvec3& up : {glm::dvec3(0, 1, 0), glm::dvec3(0, 0, 1)})
            if (const auto turned = lookAlong(at, forward, up)) return *turned;
        if (type == LightType::kPoint) return *lookAlong(at, {0, 0, -1}, {0, 1, 0});
    }
    throw Error(ErrorKind::kInput, "the node's transform gives its light no position or direction",
                "/nodes/" + std::to_string(instance.node),
                "look for scales of 0 in the node and its ancestors");
}

glm::dvec3 keyDirection() {
    using glm::vec3;
    return PEELER_KEY_DIRECTION;
}

PlacedLight keyLight() {
    PlacedLight key;
    key.name = "key";
    key.to_world = *lookAlong(glm::dvec3(0), -keyDirection(), {0, 1, 0});
    return key;
}

}  // namespace

std::vector<PlacedLight> placedLights(const PosedScene& posed) {
    const Scene& scene = posed.scene();
    std::vector<PlacedLight> lights;
    for (const LightInstance& instance : posed.lights()) {
        PlacedLight placed;
        placed.light = scene.lights[static_cast<std::size_t>(instance.light)];
        placed.node_name = scene.nodes[static_cast<std::size_t>(instance.node)].name;
        placed.name = !placed.light.name.empty() ? placed.light.name : placed.node_name;
        if (placed.name.empty()) placed.name = "light " + std::to_string(lights.size());
        placed.to_world = place(instance, placed.light.type);
        lights.push_back(placed);
    }
    if (lights.empty() && !scene.environment) lights.push_back(keyLight());
    return lights;
}

namespace {

constexpr double kViewMargin = 1.01;

/// An interval along one axis of the light.
struct Extent {
    double low = 0, high = 0;

    double middle() const { return (low + high) / 2; }
    double half() const { return (high - low) / 2; }
};

void fitOrthographic(View& view, const Extent& right, const Extent& up, const Extent& backward) {
    // A picture needs a non-zero extent.
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
    // Negative if the whole scene is behind the light.
    const double farthest = -extents[2].low;
    view.projection.near = 1e-5 * (farthest > 0 ? farthest : 1);
    return view;
}

}  // namespace peeler
