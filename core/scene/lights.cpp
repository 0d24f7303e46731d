// SPDX-License-Identifier: Apache-2.0
#include "core/scene/lights.h"

#include <cmath>

#include "core/base/error.h"
#include "core/scene/placement.h"
#include "shaders/interface.glsl"

namespace peeler {
namespace {

/// Rigid, as far as the light's type cares: a point light has no direction, and no light a roll.
glm::dmat4 place(const LightInstance& instance, LightType type) {
    const glm::dmat4& world = instance.world;
    const glm::dvec3 at(world[3]), forward = -glm::dvec3(world[2]);
    if (std::isfinite(glm::length(at))) {
        if (const auto turned = rigid(world)) return *turned;
        for (const glm::dvec3& up : {glm::dvec3(0, 1, 0), glm::dvec3(0, 0, 1)})
            if (const auto turned = lookAlong(at, forward, up)) return *turned;
        if (type == LightType::kPoint) return *lookAlong(at, {0, 0, -1}, {0, 1, 0});
    }
    throw Error(ErrorKind::kInput, "the node leaves its light no place or no direction",
                "/nodes/" + std::to_string(instance.node), "look for scales of 0 above it");
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

}  // namespace peeler
