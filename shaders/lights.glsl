// SPDX-License-Identifier: Apache-2.0
// Punctual lights (KHR_lights_punctual): direction and strength at a point in view space.

layout(std430, binding = PEELER_LIGHTS) readonly buffer Lights {
    LightCount light_count;
    LightRecord lights[];
};

const float kLeastSquare = 1e-30;  // lower limit of squared distances; avoids NaN for a light on the surface
const float kBrightest = 1e30;

/// Returns the unit direction from `position` to the light, both in view space; 0 if they coincide.
vec3 towardLight(LightRecord light, vec3 position) {
    vec3 offset = light.position.xyz - light.position.w * position;
    return offset * inversesqrt(max(dot(offset, offset), kLeastSquare));
}

/// Returns the irradiance at normal incidence, which is inversely proportional to the squared
/// distance. The extension recommends the window that limits the irradiance to the light's range,
/// and the fall-off of the cone.
vec3 irradiance(LightRecord light, vec3 position, vec3 toward) {
    if (light.position.w == 0.0) return light.color.rgb;
    vec3 offset = light.position.xyz - position;
    float squared = max(dot(offset, offset), kLeastSquare);
    float near = squared * light.axis.w * light.axis.w;  // (distance / range)²
    float window = clamp(1.0 - near * near, 0.0, 1.0);
    float cone = clamp(dot(light.axis.xyz, toward) * light.cone.x + light.cone.y, 0.0, 1.0);
    return min(light.color.rgb * (window * cone * cone / squared), kBrightest);
}
