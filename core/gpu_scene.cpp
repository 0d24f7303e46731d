// SPDX-License-Identifier: Apache-2.0
#include "core/gpu_scene.h"

#include <algorithm>
#include <array>
#include <cstring>
#include <limits>
#include <map>
#include <set>
#include <span>
#include <tuple>

#include "core/error.h"
#include "core/material_record.h"
#include "core/mipmaps.h"
#include "shaders/interface.glsl"

namespace peeler {
namespace {

// std140 records are bound one at a time, and 256 is the largest offset alignment GL allows a
// driver.
constexpr std::size_t kMaterialStride = (sizeof(shader::MaterialRecord) + 255) / 256 * 256;

// Attributes a primitive lacks read these for every vertex (a binding of stride 0).
constexpr std::array<float, 8> kMissing = {0, 0, 0, 0, 1, 1, 1, 1};
constexpr std::size_t kMissingZeros = 0, kMissingOnes = 16;

struct AttributeData {
    GLuint location;
    GLint components;
    const void* data;
    std::size_t bytes;
    std::size_t missing;  // offset of the constant that stands in
};

template <class T>
AttributeData attribute(GLuint location, const std::vector<T>& values,
                        std::size_t missing = kMissingZeros) {
    return {location, static_cast<GLint>(T::length()), values.data(), values.size() * sizeof(T),
            missing};
}

std::array<AttributeData, 6> attributes(const Primitive& p) {
    return {attribute(PEELER_POSITION, p.positions),
            attribute(PEELER_NORMAL, p.normals),
            attribute(PEELER_TANGENT, p.tangents),
            attribute(PEELER_TEXCOORD0, p.texcoords[0]),
            attribute(PEELER_TEXCOORD1, p.texcoords[1]),
            attribute(PEELER_COLOR, p.colors, kMissingOnes)};
}

/// How many primitives GL makes of n vertices; also what gl_PrimitiveID counts.
std::uint64_t primitiveCount(Topology topology, std::uint64_t n) {
    switch (topology) {
        case Topology::kPoints:
            return n;
        case Topology::kLines:
            return n / 2;
        case Topology::kLineLoop:
            return n < 2 ? 0 : n;
        case Topology::kLineStrip:
            return n < 2 ? 0 : n - 1;
        case Topology::kTriangles:
            return n / 3;
        case Topology::kTriangleStrip:
        case Topology::kTriangleFan:
            return n < 3 ? 0 : n - 2;
    }
    return 0;
}

bool isTriangles(Topology topology) {
    return topology >= Topology::kTriangles;
}

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

GpuScene::GpuScene(const gl::Context& context, const Scene& scene, const SceneContents& contents) {
    uploadMaterials(context, scene, contents);
    uploadGeometry(context.functions(), scene, contents);
    gl::checkErrors(context.functions(), "uploading the scene");
}

void GpuScene::bindMaterialRecord(std::size_t material) const {
    material_records_.bindUniform(PEELER_MATERIAL_BLOCK, material * kMaterialStride,
                                  sizeof(shader::MaterialRecord));
}

void GpuScene::uploadMaterials(const gl::Context& context, const Scene& scene,
                               const SceneContents& contents) {
    const gl::Functions& gl = context.functions();
    std::set<std::size_t> used;  // a file may hold many scenes; only what is drawn is uploaded
    for (const auto& instance : contents.meshes)
        for (const auto& p : scene.meshes[static_cast<std::size_t>(instance.mesh)].primitives)
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
            gpu.textured = true;
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
        std::memcpy(mapping.as<std::byte>() + i * kMaterialStride, &r, sizeof r);
    }
}

void GpuScene::uploadGeometry(const gl::Functions& gl, const Scene& scene,
                              const SceneContents& contents) {
    // Where every primitive's arrays go in the one buffer; 16-byte aligned.
    struct Placed {
        std::array<std::size_t, 6> attribute_offsets{};
        std::size_t index_offset = 0;
        std::size_t vertex_array = 0;
    };
    std::map<std::pair<int, std::size_t>, Placed> placed;
    std::size_t bytes = sizeof kMissing;
    const auto place = [&bytes](std::size_t size) {
        const std::size_t at = bytes;
        bytes = (bytes + size + 15) / 16 * 16;
        return at;
    };
    for (const auto& instance : contents.meshes) {
        const auto& primitives = scene.meshes[static_cast<std::size_t>(instance.mesh)].primitives;
        for (std::size_t i = 0; i < primitives.size(); ++i) {
            const auto [entry, fresh] = placed.try_emplace({instance.mesh, i});
            if (!fresh) continue;
            const auto data = attributes(primitives[i]);
            for (std::size_t a = 0; a < data.size(); ++a)
                entry->second.attribute_offsets[a] = place(data[a].bytes);
            entry->second.index_offset =
                place(primitives[i].indices.size() * sizeof(std::uint32_t));
        }
    }

    geometry_ = gl::Buffer(gl, bytes);
    {
        const auto mapping = geometry_.overwrite(bytes);
        auto* memory = mapping.as<std::byte>();
        std::memcpy(memory, kMissing.data(), sizeof kMissing);
        for (const auto& [key, where] : placed) {
            const Primitive& p =
                scene.meshes[static_cast<std::size_t>(key.first)].primitives[key.second];
            const auto data = attributes(p);
            for (std::size_t a = 0; a < data.size(); ++a)
                if (data[a].bytes)
                    std::memcpy(memory + where.attribute_offsets[a], data[a].data, data[a].bytes);
            if (!p.indices.empty()) {
                std::memcpy(memory + where.index_offset, p.indices.data(),
                            p.indices.size() * sizeof(std::uint32_t));
            }
        }
    }

    for (auto& [key, where] : placed) {
        const Primitive& p =
            scene.meshes[static_cast<std::size_t>(key.first)].primitives[key.second];
        GLuint name = 0;
        gl.CreateVertexArrays(1, &name);
        where.vertex_array = vertex_arrays_.size();
        vertex_arrays_.emplace_back(gl, name);
        const auto data = attributes(p);
        for (std::size_t a = 0; a < data.size(); ++a) {
            const auto& [location, components, pointer, size, missing] = data[a];
            const std::size_t offset = size ? where.attribute_offsets[a] : missing;
            const GLsizei stride = size ? components * static_cast<GLsizei>(sizeof(float)) : 0;
            gl.EnableVertexArrayAttrib(name, location);
            gl.VertexArrayAttribFormat(name, location, components, GL_FLOAT, GL_FALSE, 0);
            gl.VertexArrayAttribBinding(name, location, location);
            gl.VertexArrayVertexBuffer(name, location, geometry_.name(),
                                       static_cast<GLintptr>(offset), stride);
        }
        gl.VertexArrayElementBuffer(name, geometry_.name());
    }

    std::uint64_t next_primitive = 1;  // 0 is the key of "no layer yet" in front-to-back peeling
    for (const auto& instance : contents.meshes) {
        const auto& primitives = scene.meshes[static_cast<std::size_t>(instance.mesh)].primitives;
        for (std::size_t i = 0; i < primitives.size(); ++i) {
            const Primitive& p = primitives[i];
            const Material& m = scene.materials[static_cast<std::size_t>(p.material)];
            const Placed& where = placed.at({instance.mesh, i});
            GpuDraw draw;
            draw.vertex_array = where.vertex_array;
            draw.mode = static_cast<GLenum>(p.topology);
            draw.indexed = !p.indices.empty();
            const std::size_t vertices = draw.indexed ? p.indices.size() : p.positions.size();
            draw.count = static_cast<GLsizei>(vertices);
            draw.index_offset = where.index_offset;
            draw.material = static_cast<std::size_t>(p.material);
            draw.node = instance.node;
            draw.world = instance.world;
            draw.mirrored = glm::determinant(glm::dmat3(instance.world)) < 0;
            draw.first_primitive = static_cast<std::uint32_t>(next_primitive);
            next_primitive += primitiveCount(p.topology, vertices);
            if (next_primitive > std::numeric_limits<std::uint32_t>::max() ||
                vertices > std::numeric_limits<GLsizei>::max()) {
                throw Error(ErrorKind::kInput,
                            "the scene has more primitives than 32 bits can count",
                            "/meshes/" + std::to_string(instance.mesh), "render it in parts");
            }
            if (!p.normals.empty()) draw.flags |= PEELER_HAS_NORMALS;
            // Tangents without normals are to be ignored (glTF 2.0 §3.7.2.1).
            if (!p.tangents.empty() && !p.normals.empty()) draw.flags |= PEELER_HAS_TANGENTS;
            if (!p.colors.empty()) draw.flags |= PEELER_HAS_COLORS;
            if (isTriangles(p.topology)) draw.flags |= PEELER_IS_TRIANGLES;
            if (draw.mirrored) draw.flags |= PEELER_MIRRORED;
            draw.opaque = m.alpha_mode != AlphaMode::kBlend && !isTransmissive(m);
            if (m.alpha_mode != AlphaMode::kOpaque) {
                draw.textured_alpha = static_cast<bool>(m.base_color_texture);
                draw.alpha_tested = draw.textured_alpha || !p.colors.empty();
                const float alpha = m.base_color.a;
                const bool passes =
                    m.alpha_mode == AlphaMode::kMask ? alpha >= m.alpha_cutoff : alpha > 0;
                if (!draw.alpha_tested && !passes) continue;  // every fragment would be rejected
            }
            draws_.push_back(draw);
        }
    }
}

}  // namespace peeler
