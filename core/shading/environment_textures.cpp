// SPDX-License-Identifier: Apache-2.0
#include "core/shading/environment_textures.h"

#include <algorithm>
#include <span>

#include "core/shading/albedo_table.h"
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

}  // namespace

EnvironmentTextures::EnvironmentTextures(const gl::Functions& gl, const Scene& scene) : gl_(gl) {
    const bool sheen = std::any_of(scene.materials.begin(), scene.materials.end(),
                                   [](const Material& m) { return m.sheen.color != glm::vec3(0); });
    if (!scene.environment && !sheen) return;
    if (scene.environment) {
        const EnvironmentMaps maps = prefilter(*scene.environment);
        radiance_ = uploadCube(gl, maps.radiance);
        irradiance_ = uploadCube(gl, {&maps.irradiance, 1});
    }
    albedo_ = gl::makeTexture2D(gl, GL_RGBA32F, kAlbedoTableSize, kAlbedoTableSize);
    const auto& table = albedoTable(sheen);
    gl.TextureSubImage2D(albedo_.name(), 0, 0, 0, kAlbedoTableSize, kAlbedoTableSize, GL_RGB,
                         GL_FLOAT, table.data());
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
                                               {PEELER_ALBEDO_UNIT, albedo_.name()}};
    for (const auto& [unit, texture] : units) {
        if (!texture) continue;
        gl_.BindTextureUnit(unit, texture);
        gl_.BindSampler(unit, linear_.name());
    }
}

}  // namespace peeler
