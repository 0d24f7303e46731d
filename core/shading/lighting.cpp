// SPDX-License-Identifier: Apache-2.0
#include "core/shading/lighting.h"

#include <algorithm>
#include <cmath>
#include <cstring>

#include "shaders/interface.glsl"

namespace peeler {
namespace {

/// A number beyond what a float holds would shine as infinity or NaN.
glm::vec3 finite(const glm::dvec3& v) {
    constexpr double kLargest = std::numeric_limits<float>::max();
    return glm::vec3(glm::clamp(v, -kLargest, kLargest));
}

void addMap(const ShadowMaps::Map& map, const glm::dmat4& camera_to_world, shader::LightRecord& r) {
    const Projection& projection = map.view.projection;
    const glm::dmat4 map_from_light(glm::dvec4(1 / projection.half_width, 0, 0, 0),
                                    glm::dvec4(0, 1 / projection.half_height, 0, 0),
                                    glm::dvec4(0, 0, -1, 0), glm::dvec4(0, 0, 0, 1));
    r.map_from_view =
        glm::mat4(map_from_light * glm::inverse(map.view.camera_to_world) * camera_to_world);
    r.map = {map.layer, projection.perspective ? 1 : 0, 0, 0};
}

shader::LightRecord record(const PlacedLight& placed, const glm::dmat4& view_from_world) {
    const Light& light = placed.light;
    const glm::dmat4 view_from_light = view_from_world * placed.to_world;
    const glm::dvec3 backward(view_from_light[2]);  // from where it shines
    shader::LightRecord r{};
    const bool directional = light.type == LightType::kDirectional;
    r.position =
        directional ? glm::vec4(backward, 0) : glm::vec4(finite(glm::dvec3(view_from_light[3])), 1);
    r.axis = glm::vec4(backward, light.range ? 1 / *light.range : 0);
    r.color = glm::vec4(finite(light.color * light.intensity), 0);
    r.map.x = -1;
    r.cone = {0, 1, 0, 0};  // full strength in every direction
    if (light.type == LightType::kSpot) {
        const double inner = std::cos(light.inner_cone), outer = std::cos(light.outer_cone);
        const double scale = 1 / std::max(0.001, inner - outer);
        r.cone = {scale, -outer * scale, 0, 0};
    }
    return r;
}

}  // namespace

Lighting::Lighting(const gl::Functions& gl, const PosedScene& posed)
    : gl_(gl),
      lights_(placedLights(posed)),
      punctual_(!posed.lights().empty()),
      environment_(gl, posed.scene()),
      records_(gl, sizeof(shader::LightCount) + lights_.size() * sizeof(shader::LightRecord)) {}

void Lighting::bind() const {
    records_.bindStorage(PEELER_LIGHTS);
    environment_.bind();
    if (shadowed()) gl_.BindTextureUnit(PEELER_SHADOW_UNIT, shadows_->texture.name());
}

void Lighting::setView(const glm::dmat4& camera_to_world) {
    const glm::dmat4 view_from_world = glm::inverse(camera_to_world);
    const auto mapping = records_.overwrite(records_.size());
    auto* memory = mapping.as<std::byte>();
    const shader::LightCount count = {{static_cast<std::uint32_t>(lights_.size()), 0, 0, 0}};
    std::memcpy(memory, &count, sizeof count);
    for (std::size_t i = 0; i < lights_.size(); ++i) {
        auto r = record(lights_[i], view_from_world);
        if (shadowed() && shadows_->maps[i].layer >= 0)
            addMap(shadows_->maps[i], camera_to_world, r);
        std::memcpy(memory + sizeof count + i * sizeof r, &r, sizeof r);
    }
}

}  // namespace peeler
