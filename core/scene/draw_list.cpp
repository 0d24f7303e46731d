// SPDX-License-Identifier: Apache-2.0
#include "core/scene/draw_list.h"

#include <algorithm>
#include <limits>
#include <map>
#include <utility>

#include <peeler/error.h>
#include "core/scene/elements.h"
#include "core/scene/material.h"
#include "core/scene/posed_scene.h"
#include "shaders/interface.glsl"

namespace peeler {
namespace {

std::size_t verticesOf(const Primitive& p) {
    return p.indices.empty() ? p.positions.size() : p.indices.size();
}

std::uint32_t flagsOf(const Primitive& p, bool mirrored) {
    std::uint32_t flags = 0;
    if (!p.normals.empty()) flags |= PEELER_HAS_NORMALS;
    // Tangents without normals must be ignored (glTF 2.0 §3.7.2.1).
    if (!p.tangents.empty() && !p.normals.empty()) flags |= PEELER_HAS_TANGENTS;
    if (!p.colors.empty()) flags |= PEELER_HAS_COLORS;
    if (p.topology >= Topology::kTriangles) flags |= PEELER_IS_TRIANGLES;
    if (mirrored) flags |= PEELER_MIRRORED;
    return flags;
}

/// Sets a draw's alpha flags. Returns false if the alpha test rejects every fragment.
bool setAlpha(Draw& draw, const Primitive& p, const Material& m) {
    draw.opaque = isOpaque(m);
    if (m.alpha_mode == AlphaMode::kOpaque) return true;
    draw.textured_alpha = static_cast<bool>(m.base_color_texture);
    draw.alpha_tested = draw.textured_alpha || !p.colors.empty();
    const float alpha = m.base_color.a;
    const bool passes = m.alpha_mode == AlphaMode::kMask ? alpha >= m.alpha_cutoff : alpha > 0;
    return draw.alpha_tested || passes;
}

/// Whether two instances can be drawn together. Requires a mesh with a single primitive: with
/// several primitives, GL would draw all instances of the first primitive before the second, but at
/// equal depths, some methods need fragments in key order.
bool together(const Scene& scene, const MeshInstance& a, const MeshInstance& b) {
    const auto& primitives = scene.meshes[static_cast<std::size_t>(a.mesh)].primitives;
    return primitives.size() == 1 && a.node == b.node && a.mesh == b.mesh &&
           a.mirrored == b.mirrored && a.deformed == b.deformed;
}

}  // namespace

/// Chooses the spacing of entries in near_. The spacing is wide enough that there are few entries,
/// and narrow enough that there are few surfaces between two entries.
KeyIndex::KeyIndex(std::vector<std::uint32_t> first_keys, std::uint64_t end)
    : first_keys_(std::move(first_keys)) {
    constexpr std::uint64_t kLeast = 4096;
    while (end >> shift_ > 2 * first_keys_.size() + kLeast)
        ++shift_;
    std::uint32_t surface = 0;
    for (std::uint64_t key = 0; key < end; key += std::uint64_t{1} << shift_) {
        while (surface + 1 < first_keys_.size() && first_keys_[surface + 1] <= key)
            ++surface;
        near_.push_back(surface);
    }
    near_.push_back(static_cast<std::uint32_t>(first_keys_.size()) - 1);
}

DrawList::DrawList(const Scene& scene, std::span<const MeshInstance> instances) {
    for (std::size_t i = 0, end = 0; i < instances.size(); i = end) {
        do
            ++end;
        while (end < instances.size() && together(scene, instances[i], instances[end]));
        addGroup(scene, instances.subspan(i, end - i));
    }
    std::vector<std::uint32_t> first_keys;
    first_keys.reserve(surfaces_.size());
    for (const DrawnSurface& surface : surfaces_)
        first_keys.push_back(surface.first_key);
    keys_ = {std::move(first_keys), next_key_};
}

std::size_t DrawList::indexOf(const Geometry& geometry) {
    const auto [entry, fresh] = geometry_index_.try_emplace(geometry, geometries_.size());
    if (fresh) geometries_.push_back(geometry);
    return entry->second;
}

/// Adds a group of instances that are drawn together.
void DrawList::addGroup(const Scene& scene, std::span<const MeshInstance> instances) {
    const MeshInstance& first = instances.front();
    const auto& primitives = scene.meshes[static_cast<std::size_t>(first.mesh)].primitives;
    const auto first_key = static_cast<std::uint32_t>(next_key_);
    const std::size_t first_surface = surfaces_.size(), first_world = worlds_.size();
    std::uint64_t keys = 0;
    std::size_t most_vertices = 0;
    for (const Primitive& p : primitives) {
        keys += elementsOf(p);
        most_vertices = std::max(most_vertices, verticesOf(p));
    }
    // This cannot overflow, since more than 2^32 elements or instances would not fit into memory.
    next_key_ += keys * instances.size();
    if (next_key_ > std::numeric_limits<std::uint32_t>::max() ||
        most_vertices > std::numeric_limits<int>::max()) {
        throw Error(ErrorKind::kInput, "the scene has more primitives than 32 bits can count",
                    "/meshes/" + std::to_string(first.mesh),
                    "render parts of it: " + Parameter::kInclude + ", " + Parameter::kExclude);
    }
    addSurfaces(primitives, first_key, instances.size());
    for (const MeshInstance& instance : instances)
        worlds_.push_back(instance.world);

    for (std::size_t i = 0; i < primitives.size(); ++i) {
        const Primitive& p = primitives[i];
        if (p.splats) continue;  // GL does not draw them
        Draw draw;
        draw.geometry = indexOf({first.mesh, i, first.deformed});
        draw.topology = p.topology;
        draw.indexed = !p.indices.empty();
        draw.count = static_cast<int>(verticesOf(p));
        draw.first_world = first_world;
        draw.instances = instances.size();
        draw.material = static_cast<std::size_t>(p.material);
        draw.node = first.node;
        draw.mirrored = first.mirrored;
        draw.first_primitive = surfaces_[first_surface + i].first_key;
        draw.instance_keys = static_cast<std::uint32_t>(keys);
        draw.flags = flagsOf(p, first.mirrored);
        if (setAlpha(draw, p, scene.materials[draw.material])) draws_.push_back(draw);
    }
}

/// Adds the surfaces of a group of instances. Must be called before the instances' matrices are
/// added to worlds_, since the size of worlds_ gives the index of the first instance. `first_key`
/// is the first key of the first instance.
void DrawList::addSurfaces(std::span<const Primitive> primitives, std::uint32_t first_key,
                           std::size_t instances) {
    for (std::size_t i = 0; i < instances; ++i) {
        std::uint32_t in_mesh = 0;
        for (std::size_t p = 0; p < primitives.size(); ++p) {
            surfaces_.push_back({first_key + in_mesh, in_mesh,
                                 static_cast<std::uint32_t>(worlds_.size() + i),
                                 static_cast<std::uint32_t>(p)});
            in_mesh += static_cast<std::uint32_t>(elementsOf(primitives[p]));
        }
        first_key += in_mesh;
    }
}

KeyOrigin DrawList::originOf(std::uint32_t key) const {
    const DrawnSurface& surface = surfaces_[surfaceOf(key)];
    const std::uint32_t element = key - surface.first_key;
    return {surface.instance, surface.primitive, element, surface.in_mesh + element};
}

}  // namespace peeler
