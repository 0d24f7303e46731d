// SPDX-License-Identifier: Apache-2.0
#include "core/capture/gpu_geometry.h"

#include <array>
#include <cstddef>
#include <cstring>
#include <map>
#include <utility>

#include "shaders/interface.glsl"

namespace peeler {
namespace {

// Attributes that a primitive lacks read these for every vertex (a binding of stride 0).
constexpr std::array<float, 8> kMissing = {0, 0, 0, 0, 1, 1, 1, 1};
constexpr std::size_t kMissingZeros = 0, kMissingOnes = 16;

struct Attribute {
    GLuint location;
    GLint components;
    const void* data;
    std::size_t bytes;
    std::size_t missing;  // offset of the constant that stands in
};

template <class T>
Attribute attribute(GLuint location, const std::vector<T>& values,
                    std::size_t missing = kMissingZeros) {
    return {location, static_cast<GLint>(T::length()), values.data(), values.size() * sizeof(T),
            missing};
}

/// Those that deformation replaces come first.
constexpr std::size_t kDeformed = 3;

template <class Vertices>
std::array<Attribute, kDeformed> movable(const Vertices& v) {
    return {attribute(PEELER_POSITION, v.positions), attribute(PEELER_NORMAL, v.normals),
            attribute(PEELER_TANGENT, v.tangents)};
}

std::array<Attribute, 6> attributes(const Primitive& p) {
    const auto [position, normal, tangent] = movable(p);
    return {position,
            normal,
            tangent,
            attribute(PEELER_TEXCOORD0, p.texcoords[0]),
            attribute(PEELER_TEXCOORD1, p.texcoords[1]),
            attribute(PEELER_COLOR, p.colors, kMissingOnes)};
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

/// Copies the arrays one after the other.
template <class Attributes>
void copy(const Attributes& list, std::byte* to) {
    for (const Attribute& a : list) {
        if (a.bytes) std::memcpy(to, a.data, a.bytes);
        to += aligned(a.bytes);
    }
}

/// Lets the vertex array read attributes that lie one after the other from `offset` on.
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
    // Where the arrays of every primitive go, then its indices; deformed ones share the rest.
    std::map<std::pair<int, std::size_t>, std::size_t> offsets;
    std::size_t fixed_bytes = sizeof kMissing, deformed_bytes = 0;
    for (const Geometry& geometry : geometries) {
        Slot& slot = slots_.emplace_back();
        const Primitive& p = primitiveOf(scene, geometry.mesh, geometry.primitive);
        const auto [entry, fresh] =
            offsets.try_emplace({geometry.mesh, geometry.primitive}, fixed_bytes);
        slot.index_offset = entry->second + alignedBytes(attributes(p));
        if (fresh)
            fixed_bytes = slot.index_offset + aligned(p.indices.size() * sizeof(std::uint32_t));
        slot.box.add(p.positions);
        if (geometry.deformed < 0) continue;
        slot.deformed_offset = deformed_bytes;
        deformed_bytes += alignedBytes(movable(deformedOf(posed, geometry)));
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

    for (std::size_t i = 0; i < slots_.size(); ++i) {
        const Geometry& geometry = geometries[i];
        const std::size_t offset = offsets.at({geometry.mesh, geometry.primitive});
        Slot& slot = slots_[i];
        slot.vertex_array = makeVertexArray(
            gl, primitiveOf(scene, geometry.mesh, geometry.primitive), fixed_.name(), offset);
        if (geometry.deformed >= 0)
            point(gl, slot.vertex_array.name(), movable(deformedOf(posed, geometry)),
                  deformed_.name(), slot.deformed_offset);
    }
    setDeformed(posed);
}

void GpuGeometry::setDeformed(const PosedScene& posed) {
    if (!deformed_) return;
    const auto mapping = deformed_.overwrite(deformed_.size());
    auto* memory = mapping.as<std::byte>();
    for (std::size_t i = 0; i < slots_.size(); ++i) {
        const Geometry& geometry = posed.drawList().geometries()[i];
        if (geometry.deformed < 0) continue;
        const DeformedVertices& vertices = deformedOf(posed, geometry);
        copy(movable(vertices), memory + slots_[i].deformed_offset);
        slots_[i].box = {};
        slots_[i].box.add(vertices.positions);
    }
}

}  // namespace peeler
