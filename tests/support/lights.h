// SPDX-License-Identifier: Apache-2.0
// Lights and environments for tests.
#pragma once

#include <glm/glm.hpp>

#include <peeler/scene.h>

namespace peeler::test {

inline Light lightOf(LightType type, double intensity, const glm::dvec3& rgb = glm::dvec3(1)) {
    Light light;
    light.type = type;
    light.intensity = intensity;
    light.color = rgb;
    return light;
}

/// Returns an environment with the same radiance in all directions.
inline Environment uniformEnvironment(const glm::vec3& radiance) {
    Environment environment;
    environment.width = 2;
    environment.height = 1;
    environment.radiance.assign(2, radiance);
    return environment;
}

}  // namespace peeler::test
