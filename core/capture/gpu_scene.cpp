// SPDX-License-Identifier: Apache-2.0
#include "core/capture/gpu_scene.h"

#include <algorithm>
#include <array>
#include <cstring>
#include <map>
#include <set>
#include <tuple>

#include "core/base/error.h"
#include "core/shading/material_record.h"
#include "core/shading/mipmaps.h"
#include "shaders/interface.glsl"

namespace peeler {
namespace {

// std140 records are bound one at a time, and 256 is the largest offset alignment GL allows a
// driver.
constexpr std::size_t kMaterialStride = (sizeof(shader::MaterialRecord) + 255) / 256 * 256;

gl::Texture uploadImage(const gl::Functions& gl, const Image& image, bool srgb, int largest) {
    if (image.width > largest || image.height > largest) {
        throw Error(ErrorKind::kInput,
                    "the image is " + std::to_string(image.width) + "x" +
                        std::to_string(image.height) + ", and the GL device takes " +
                        std::to_string(largest),
                    image.name, "scale it down");
    }
    auto texture = gl::makeTexture2D(gl, srgb ? GL_SRGB8_ALPHA8 : GL_RGBA8, image.width,
                                     image.height, mipmapLevels(image.width, image.height));
    gl.PixelStorei(GL_UNPACK_ALIGNMENT, 1);
    Image smaller;
    const Image* level = &image;
    for (GLint i = 0; i < mipmapLevels(image.width, image.height); ++i) {
        if (i > 0) smaller = halved(*level, srgb);
        if (i > 0) level = &smaller;
        gl.TextureSubImage2D(texture.name(), i, 0, 0, level->width, level->height, GL_RGBA,
                             GL_UNSIGNED_BYTE, level->rgba.data());
    }
    return texture;
}

gl::SamplerObject makeSampler(const gl::Functions& gl, const Sampler& sampler) {
    GLuint name = 0;
    gl.CreateSamplers(1, &name);
    gl.SamplerParameteri(name, GL_TEXTURE_MAG_FILTER, sampler.mag_filter);
    gl.SamplerParameteri(name, GL_TEXTURE_MIN_FILTER, sampler.min_filter);
    gl.SamplerParameteri(name, GL_TEXTURE_WRAP_S, sampler.wrap_s);
    gl.SamplerParameteri(name, GL_TEXTURE_WRAP_T, sampler.wrap_t);
    return {gl, name};
}

}  // namespace

GpuScene::GpuScene(const gl::Context& context, const PosedScene& posed)
    : posed_(posed), geometry_(context.functions(), posed) {
    uploadMaterials(context);
    gl::checkErrors(context.functions(), "uploading the scene");
}

void GpuScene::setPose(const PosedScene& posed) {
    posed_ = posed;
    geometry_.setDeformed(posed);
}

void GpuScene::bindMaterialRecord(std::size_t material) const {
    material_records_.bindUniform(PEELER_MATERIAL_BLOCK, material * kMaterialStride,
                                  sizeof(shader::MaterialRecord));
}

void GpuScene::uploadMaterials(const gl::Context& context) {
    const Scene& scene = posed_.scene();
    const gl::Functions& gl = context.functions();
    std::set<std::size_t> used;  // a file may hold many scenes; only what is drawn is uploaded
    for (const MeshInstance& instance : posed_.meshes())
        for (const Primitive& p : posed_.primitives(instance))
            used.insert(static_cast<std::size_t>(p.material));

    std::map<std::pair<int, bool>, GLuint> uploaded;
    std::map<std::tuple<int, int, int, int>, GLuint> sampler_names;
    materials_.resize(scene.materials.size());
    for (const std::size_t index : used) {
        Material m = scene.materials[index];
        GpuMaterial& gpu = materials_[index];
        gpu.unlit = m.unlit;
        gpu.double_sided = m.double_sided;
        for (std::size_t i = 0; i < materialFeatures().size(); ++i)
            if (materialFeatures()[i].used(m)) gpu.features |= 1U << i;
        checkTextureUnits(m, context.device().limits.texture_units);
        const auto textures = texturesOf(m);
        for (std::size_t unit = 0; unit < textures.size(); ++unit) {
            const auto& [ref, srgb] = textures[unit];
            if (!*ref) continue;
            GLuint& texture = uploaded[{ref->image, srgb}];
            if (!texture) {
                textures_.push_back(uploadImage(gl,
                                                scene.images[static_cast<std::size_t>(ref->image)],
                                                srgb, context.device().limits.texture_size));
                texture = textures_.back().name();
            }
            const Sampler& s = ref->sampler;
            GLuint& sampler = sampler_names[{s.mag_filter, s.min_filter, s.wrap_s, s.wrap_t}];
            if (!sampler) {
                samplers_.push_back(makeSampler(gl, s));
                sampler = samplers_.back().name();
            }
            gpu.bindings[unit] = {texture, sampler};
        }
    }
    const std::size_t bytes = scene.materials.size() * kMaterialStride;
    material_records_ = gl::Buffer(gl, bytes);
    const auto mapping = material_records_.overwrite(bytes);
    for (std::size_t i = 0; i < scene.materials.size(); ++i) {
        const auto r = materialRecord(scene.materials[i]);
        materials_[i].flags = r.flags;
        std::memcpy(mapping.as<std::byte>() + i * kMaterialStride, &r, sizeof r);
    }
}

}  // namespace peeler
