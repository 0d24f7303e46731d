// SPDX-License-Identifier: Apache-2.0
// The table of hit columns, and the computation of their values for a batch of hits.
#include "formats/rays/hit_columns.h"

#include <algorithm>

#include <peeler/error.h>
#include "core/scene/view.h"
#include "formats/file/byte_buffer.h"

namespace peeler {
namespace {

/// Stores value(i) for every hit i.
template <class Value>
void putEach(const HitBatch& hits, std::byte* out, std::size_t stride, Value&& value) {
    for (std::size_t i = 0; i < hits.size; ++i)
        storeNumber(value(i), out + i * stride);
}

/// Stores, for every hit, a property of its instance.
void putShared(const HitBatch& hits, std::byte* out, std::size_t stride,
               std::uint32_t HitInstance::*number) {
    putEach(hits, out, stride,
            [&](std::size_t i) { return hits.instances[hits.places[i].instance].*number; });
}

/// Stores vectors that point to the front of the surface. `vectors` point to the ray's side.
void putOnTheFront(const HitBatch& hits, std::byte* out, std::size_t stride,
                   std::span<const glm::vec3> vectors) {
    putEach(hits, out, stride, [&](std::size_t i) { return hits.facing[i] * vectors[i]; });
}

/// Returns a premultiplied colour, not multiplied.
glm::vec4 straight(const glm::vec4& color) {
    return color.a > 0 ? glm::vec4(glm::vec3(color) / color.a, color.a) : glm::vec4(0);
}

}  // namespace

std::span<const HitColumn> hitColumns() {
    using enum NumberType;
    static const HitColumn kColumns[] = {
        {"t_hit",
         kFloat,
         {"t"},
         {},
         [](const HitBatch& hits, std::byte* out, std::size_t stride) {
             putEach(hits, out, stride, [&](std::size_t i) { return hits.t[i]; });
         }},
        {kCameraZColumn,
         kFloat,
         {"camera_z"},
         {},
         [](const HitBatch& hits, std::byte* out, std::size_t stride) {
             putEach(hits, out, stride, [&](std::size_t i) { return hits.camera_z[i]; });
         }},
        {"geometry_ids",
         kUint32,
         {"geometry"},
         {},
         [](const HitBatch& hits, std::byte* out, std::size_t stride) {
             putEach(hits, out, stride, [&](std::size_t i) { return hits.places[i].instance; });
         }},
        {"primitive_ids",
         kUint32,
         {"primitive"},
         {},
         [](const HitBatch& hits, std::byte* out, std::size_t stride) {
             putEach(hits, out, stride, [&](std::size_t i) { return hits.places[i].in_mesh; });
         }},
        {"primitive_uvs",
         kFloat,
         {"u", "v"},
         {Channel::kBarycentric},
         [](const HitBatch& hits, std::byte* out, std::size_t stride) {
             putEach(hits, out, stride, [&](std::size_t i) { return hits.barycentrics[i]; });
         }},
        {"facing",
         kInt32,
         {"facing"},
         {Channel::kFacing},
         [](const HitBatch& hits, std::byte* out, std::size_t stride) {
             putEach(hits, out, stride,
                     [&](std::size_t i) { return static_cast<std::int32_t>(hits.facing[i]); });
         }},
        {"normals",
         kFloat,
         {"nx", "ny", "nz"},
         {Channel::kNormal, Channel::kFacing},
         [](const HitBatch& hits, std::byte* out, std::size_t stride) {
             putOnTheFront(hits, out, stride, hits.normals);
         }},
        {"primitive_normals",
         kFloat,
         {"ngx", "ngy", "ngz"},
         {Channel::kGeometricNormal, Channel::kFacing},
         [](const HitBatch& hits, std::byte* out, std::size_t stride) {
             putOnTheFront(hits, out, stride, hits.geometric_normals);
         }},
        {"node_ids",
         kUint32,
         {"node"},
         {},
         [](const HitBatch& hits, std::byte* out, std::size_t stride) {
             putShared(hits, out, stride, &HitInstance::node);
         }},
        {"mesh_ids",
         kUint32,
         {"mesh"},
         {},
         [](const HitBatch& hits, std::byte* out, std::size_t stride) {
             putShared(hits, out, stride, &HitInstance::mesh);
         }},
        {"instance_ids",
         kUint32,
         {"instance"},
         {},
         [](const HitBatch& hits, std::byte* out, std::size_t stride) {
             putShared(hits, out, stride, &HitInstance::ordinal);
         }},
        {"material_ids",
         kUint32,
         {"material"},
         {},
         [](const HitBatch& hits, std::byte* out, std::size_t stride) {
             putEach(hits, out, stride, [&](std::size_t i) { return hits.places[i].material; });
         }},
        {kBaseColorColumn,
         kFloat,
         {"base_r", "base_g", "base_b", "base_a"},
         {},
         [](const HitBatch& hits, std::byte* out, std::size_t stride) {
             putEach(hits, out, stride,
                     [&](std::size_t i) { return straight(hits.base_colors[i]); });
         },
         false},
    };
    return kColumns;
}

std::vector<HitColumn> chosenHitColumns(std::span<const std::string> names,
                                        std::span<const Bundle> bundles) {
    const std::span<const HitColumn> all = hitColumns();
    for (const std::string& name : names)
        if (std::ranges::find(all, name, &HitColumn::name) == all.end())
            throw Error(ErrorKind::kInternal, "hits have no such column", name);
    std::vector<HitColumn> chosen;
    for (const HitColumn& column : all)
        if (names.empty()
                ? column.by_default && (column.name != kCameraZColumn || haveLens(bundles))
                : std::ranges::find(names, column.name) != names.end())
            chosen.push_back(column);
    if (std::ranges::find(names, kCameraZColumn) == names.end()) return chosen;
    for (const Bundle& bundle : bundles)
        if (bundle.view.rays && !lensCameraOf(bundle.view))
            throw Error(ErrorKind::kUsage, "a moving camera or a list of rays has no camera Z",
                        std::string(kCameraZColumn), "leave this column out");
    return chosen;
}

bool haveLens(std::span<const Bundle> bundles) {
    return std::ranges::any_of(bundles, [](const Bundle& b) { return lensCameraOf(b.view); });
}

double cameraZScale(const View& view, int x, int y) {
    return lensCameraOf(view) ? -view.rays->at(glm::dvec2(x, y) + view.sample).direction.z : 1;
}

std::vector<Channel> channelsOf(std::span<const HitColumn> columns) {
    std::vector<Channel> channels;
    for (const HitColumn& column : columns)
        channels.insert(channels.end(), column.channels.begin(), column.channels.end());
    std::ranges::sort(channels);
    channels.erase(std::unique(channels.begin(), channels.end()), channels.end());
    return channels;
}

}  // namespace peeler
