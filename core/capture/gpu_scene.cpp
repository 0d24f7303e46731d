// SPDX-License-Identifier: Apache-2.0
#include "core/capture/gpu_scene.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <cstddef>
#include <cstring>
#include <map>
#include <set>
#include <tuple>
#include <utility>

#include <peeler/error.h>
#include "core/scene/material.h"
#include "core/shading/materials.h"
#include "shaders/interface.glsl"

namespace peeler {
namespace {

/// The margin of screen bounds, in pixels. It allows for the width of lines and points, and for
/// snapped coordinates.
constexpr double kPixelMargin = 2;

/// The maximum relative error of a clip coordinate. The coordinate is the sum of four products
/// (matrix entry times coordinate), and every operation rounds to float.
constexpr double kClipRounding = 8.0 / (1 << 24);

}  // namespace

void Box::add(std::span<const glm::vec3> points) {
    for (const glm::vec3& point : points) {
        min = glm::min(min, point);
        max = glm::max(max, point);
    }
}

Window screenBounds(const Box& box, const glm::dmat4& clip_from_model, int width, int height) {
    const Window all{0, 0, width, height};
    if (box.empty()) return {};
    glm::dmat4 sizes;
    for (int i = 0; i < 4; ++i)
        sizes[i] = glm::abs(clip_from_model[i]);
    const glm::dvec2 size(width, height);
    glm::dvec2 low(std::numeric_limits<double>::infinity()), high = -low;
    for (int corner = 0; corner < 8; ++corner) {
        const glm::dvec4 point((corner & 1) ? box.max.x : box.min.x,
                               (corner & 2) ? box.max.y : box.min.y,
                               (corner & 4) ? box.max.z : box.min.z, 1);
        const glm::dvec4 clip = clip_from_model * point;
        const glm::dvec4 error = kClipRounding * (sizes * glm::abs(point));
        const double least_w = clip.w - error.w;
        if (!(least_w > 0)) return all;
        const glm::dvec2 ndc = glm::dvec2(clip) / clip.w;
        const glm::dvec2 off = (glm::dvec2(error) + glm::abs(ndc) * error.w) / least_w;
        low = glm::min(low, (ndc - off + 1.0) / 2.0 * size - kPixelMargin);
        high = glm::max(high, (ndc + off + 1.0) / 2.0 * size + kPixelMargin);
    }
    // Negated, so that the condition also holds for non-finite values.
    if (!(low.x <= high.x && low.y <= high.y)) return all;
    low = glm::clamp(glm::floor(low), glm::dvec2(0), size);
    high = glm::clamp(glm::ceil(high), glm::dvec2(0), size);
    return {static_cast<int>(low.x), static_cast<int>(low.y), static_cast<int>(high.x),
            static_cast<int>(high.y)};
}

namespace {

// The values that replace a missing attribute. They are the same for every vertex (a binding of
// stride 0).
constexpr std::array<float, 8> kMissing = {0, 0, 0, 0, 1, 1, 1, 1};
constexpr std::size_t kMissingZeros = 0, kMissingOnes = 16;

struct Attribute {
    GLuint location;
    GLint components;
    const void* data;
    std::size_t bytes;
    std::size_t missing;  // offset into kMissing, in bytes
};

template <class T>
Attribute attribute(GLuint location, const std::vector<T>& values,
                    std::size_t missing = kMissingZeros) {
    return {location, static_cast<GLint>(T::length()), values.data(), values.size() * sizeof(T),
            missing};
}

/// Returns the attributes of a primitive or of its deformed vertices.
template <class Vertices>
std::array<Attribute, 6> attributes(const Vertices& v) {
    return {attribute(PEELER_POSITION, v.positions),
            attribute(PEELER_NORMAL, v.normals),
            attribute(PEELER_TANGENT, v.tangents),
            attribute(PEELER_TEXCOORD0, v.texcoords[0]),
            attribute(PEELER_TEXCOORD1, v.texcoords[1]),
            attribute(PEELER_COLOR, v.colors, kMissingOnes)};
}

std::size_t aligned(std::size_t bytes) {
    return (bytes + 15) / 16 * 16;
}

template <class Attributes>
std::size_t alignedBytes(const Attributes& list) {
    std::size_t bytes = 0;
    for (const Attribute& a : list)
        bytes += aligned(a.bytes);
    return bytes;
}

template <class Attributes>
void copy(const Attributes& list, std::byte* to) {
    for (const Attribute& a : list) {
        if (a.bytes) std::memcpy(to, a.data, a.bytes);
        to += aligned(a.bytes);
    }
}

/// Sets the vertex array's attribute bindings to consecutive arrays from `offset` on.
template <class Attributes>
void point(const gl::Functions& gl, GLuint vertex_array, const Attributes& list, GLuint buffer,
           std::size_t offset) {
    for (const Attribute& a : list) {
        if (!a.bytes) continue;
        gl.VertexArrayVertexBuffer(vertex_array, a.location, buffer, static_cast<GLintptr>(offset),
                                   a.components * static_cast<GLsizei>(sizeof(float)));
        offset += aligned(a.bytes);
    }
}

const Primitive& primitiveOf(const Scene& scene, int mesh, std::size_t primitive) {
    return scene.meshes[static_cast<std::size_t>(mesh)].primitives[primitive];
}

const DeformedVertices& deformedOf(const PosedScene& posed, const Geometry& geometry) {
    return posed.deformed()[static_cast<std::size_t>(geometry.deformed)][geometry.primitive];
}

gl::VertexArray makeVertexArray(const gl::Functions& gl, const Primitive& p, GLuint buffer,
                                std::size_t offset) {
    GLuint name = 0;
    gl.CreateVertexArrays(1, &name);
    gl::VertexArray result(gl, name);
    const auto list = attributes(p);
    for (const Attribute& a : list) {
        gl.EnableVertexArrayAttrib(name, a.location);
        gl.VertexArrayAttribFormat(name, a.location, a.components, GL_FLOAT, GL_FALSE, 0);
        gl.VertexArrayAttribBinding(name, a.location, a.location);
        gl.VertexArrayVertexBuffer(name, a.location, buffer, static_cast<GLintptr>(a.missing), 0);
    }
    point(gl, name, list, buffer, offset);
    gl.VertexArrayElementBuffer(name, buffer);
    return result;
}

}  // namespace

GpuGeometry::GpuGeometry(const gl::Functions& gl, const PosedScene& posed) {
    const Scene& scene = posed.scene();
    const std::vector<Geometry>& geometries = posed.drawList().geometries();
    // The offset of every primitive's vertex arrays. The primitive's indices follow its arrays.
    // Deformed instances share the arrays that deformation does not change.
    std::map<std::pair<int, std::size_t>, std::size_t> offsets;
    std::size_t fixed_bytes = sizeof kMissing, deformed_bytes = 0;
    for (const Geometry& geometry : geometries) {
        StoredGeometry& stored = geometries_.emplace_back();
        const Primitive& p = primitiveOf(scene, geometry.mesh, geometry.primitive);
        const auto [entry, fresh] =
            offsets.try_emplace({geometry.mesh, geometry.primitive}, fixed_bytes);
        stored.index_offset = entry->second + alignedBytes(attributes(p));
        if (fresh)
            fixed_bytes = stored.index_offset + aligned(p.indices.size() * sizeof(std::uint32_t));
        stored.box.add(p.positions);
        if (geometry.deformed < 0) continue;
        stored.deformed_offset = deformed_bytes;
        deformed_bytes += alignedBytes(attributes(deformedOf(posed, geometry)));
    }

    fixed_ = gl::Buffer(gl, fixed_bytes);
    {
        const auto mapping = fixed_.overwrite(fixed_bytes);
        auto* memory = mapping.as<std::byte>();
        std::memcpy(memory, kMissing.data(), sizeof kMissing);
        for (const auto& [key, offset] : offsets) {
            const Primitive& p = primitiveOf(scene, key.first, key.second);
            const auto arrays = attributes(p);
            copy(arrays, memory + offset);
            if (!p.indices.empty())
                std::memcpy(memory + offset + alignedBytes(arrays), p.indices.data(),
                            p.indices.size() * sizeof(std::uint32_t));
        }
    }
    if (deformed_bytes) deformed_ = gl::Buffer(gl, deformed_bytes);

    for (std::size_t i = 0; i < geometries_.size(); ++i) {
        const Geometry& geometry = geometries[i];
        const std::size_t offset = offsets.at({geometry.mesh, geometry.primitive});
        StoredGeometry& stored = geometries_[i];
        stored.vertex_array = makeVertexArray(
            gl, primitiveOf(scene, geometry.mesh, geometry.primitive), fixed_.name(), offset);
        if (geometry.deformed >= 0)
            point(gl, stored.vertex_array.name(), attributes(deformedOf(posed, geometry)),
                  deformed_.name(), stored.deformed_offset);
    }
    setDeformed(posed);
}

void GpuGeometry::setDeformed(const PosedScene& posed) {
    if (!deformed_) return;
    const auto mapping = deformed_.overwrite(deformed_.size());
    auto* memory = mapping.as<std::byte>();
    for (std::size_t i = 0; i < geometries_.size(); ++i) {
        const Geometry& geometry = posed.drawList().geometries()[i];
        if (geometry.deformed < 0) continue;
        const DeformedVertices& vertices = deformedOf(posed, geometry);
        copy(attributes(vertices), memory + geometries_[i].deformed_offset);
        geometries_[i].box = {};
        geometries_[i].box.add(vertices.positions);
    }
}

namespace {

// The stride of material records. Every draw binds a single std140 record, and GL implementations
// may require an alignment of up to 256 bytes.
constexpr std::size_t kMaterialStride = (sizeof(shader::MaterialRecord) + 255) / 256 * 256;

gl::Texture uploadImage(const gl::Functions& gl, const Image& image, bool srgb, int largest) {
    if (image.width > largest || image.height > largest) {
        throw Error(ErrorKind::kInput,
                    "the image is " + std::to_string(image.width) + "x" +
                        std::to_string(image.height) + ", but the GL device takes at most " +
                        std::to_string(largest) + " pixels per side",
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
    std::set<std::size_t> used;  // drawn materials; other scenes of the file may use others
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
