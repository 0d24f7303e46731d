// SPDX-License-Identifier: Apache-2.0
#include "core/shading/lighting.h"

#include <algorithm>
#include <cmath>
#include <cstring>
#include <span>

#include "core/shading/albedo_table.h"
#include "core/shading/constants.h"
#include "core/shading/environment_maps.h"
#include "shaders/interface.glsl"

namespace peeler {
namespace {

gl::Texture uploadCube(const gl::Functions& gl, std::span<const CubeMap> levels) {
    auto texture =
        gl::makeTextureCube(gl, GL_RGBA32F, levels.front().size, static_cast<int>(levels.size()));
    gl.PixelStorei(GL_UNPACK_ALIGNMENT, 1);
    for (std::size_t level = 0; level < levels.size(); ++level) {
        const int size = levels[level].size;
        gl.TextureSubImage3D(texture.name(), static_cast<GLint>(level), 0, 0, 0, size, size, 6,
                             GL_RGB, GL_FLOAT, levels[level].texels.data());
    }
    return texture;
}

gl::Texture uploadTable(const gl::Functions& gl, std::span<const glm::vec4> table) {
    auto texture = gl::makeTexture2D(gl, GL_RGBA32F, kAlbedoTableSize, kAlbedoTableSize);
    gl.TextureSubImage2D(texture.name(), 0, 0, 0, kAlbedoTableSize, kAlbedoTableSize, GL_RGBA,
                         GL_FLOAT, table.data());
    return texture;
}

EnvironmentMaps mapsOf(const Environment& environment) {
    const bool known = environment.is_studio && environment.rotation == 0;
    return known ? embeddedStudioMaps() : prefilter(environment);
}

}  // namespace

EnvironmentTextures::EnvironmentTextures(const gl::Functions& gl, const Scene& scene) : gl_(gl) {
    const bool sheen = std::any_of(scene.materials.begin(), scene.materials.end(),
                                   [](const Material& m) { return m.sheen.color != glm::vec3(0); });
    if (!scene.environment && !sheen) return;
    if (scene.environment) {
        const EnvironmentMaps maps = mapsOf(*scene.environment);
        radiance_ = uploadCube(gl, maps.radiance);
        irradiance_ = uploadCube(gl, {&maps.irradiance, 1});
        lobes_ = uploadTable(gl, constants().lobes);
    }
    albedo_ = uploadTable(gl, constants().albedos);
    GLuint name = 0;
    gl.CreateSamplers(1, &name);
    linear_ = gl::SamplerObject(gl, name);
    gl.SamplerParameteri(name, GL_TEXTURE_MIN_FILTER, GL_LINEAR_MIPMAP_LINEAR);
    gl.SamplerParameteri(name, GL_TEXTURE_MAG_FILTER, GL_LINEAR);
    gl.SamplerParameteri(name, GL_TEXTURE_WRAP_S, GL_CLAMP_TO_EDGE);
    gl.SamplerParameteri(name, GL_TEXTURE_WRAP_T, GL_CLAMP_TO_EDGE);
    gl::checkErrors(gl, "uploading the environment");
}

void EnvironmentTextures::bind() const {
    if (!albedo_) return;
    gl_.Enable(GL_TEXTURE_CUBE_MAP_SEAMLESS);
    const std::pair<GLuint, GLuint> units[] = {{PEELER_ENVIRONMENT_UNIT, radiance_.name()},
                                               {PEELER_IRRADIANCE_UNIT, irradiance_.name()},
                                               {PEELER_ALBEDO_UNIT, albedo_.name()},
                                               {PEELER_LOBE_UNIT, lobes_.name()}};
    for (const auto& [unit, texture] : units) {
        if (!texture) continue;
        gl_.BindTextureUnit(unit, texture);
        gl_.BindSampler(unit, linear_.name());
    }
}

namespace {

/// Clamps to the range of a float. Larger values would become infinity or NaN.
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
    const glm::dvec3 backward(view_from_light[2]);  // toward the light
    shader::LightRecord r{};
    const bool directional = light.type == LightType::kDirectional;
    r.position =
        directional ? glm::vec4(backward, 0) : glm::vec4(finite(glm::dvec3(view_from_light[3])), 1);
    r.axis = glm::vec4(backward, light.range ? 1 / *light.range : 0);
    r.color = glm::vec4(finite(light.color * light.intensity), 0);
    r.map.x = -1;
    r.cone = {0, 1, 0, 0};  // full strength in all directions
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
