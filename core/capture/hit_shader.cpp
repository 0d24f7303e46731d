// SPDX-License-Identifier: Apache-2.0
#include "core/capture/hit_shader.h"

#include <algorithm>
#include <cmath>
#include <cstring>
#include <optional>
#include <utility>

#include "core/base/parallel.h"
#include "core/raster/surface_points.h"
#include "core/raster/surface_values.h"
#include "core/scene/elements.h"
#include "core/scene/material.h"
#include "core/scene/view.h"
#include "shaders/interface.glsl"

namespace peeler {
namespace {

constexpr std::size_t kHitsOfTask = 1024;  // hits of a parallel task

/// Returns an index from keys to draws.
KeyIndex drawsByKey(const DrawList& list) {
    std::vector<std::uint32_t> first_keys;
    std::uint64_t end = 1;
    for (const Draw& draw : list.draws()) {
        first_keys.push_back(draw.first_primitive);
        end = draw.first_primitive + std::uint64_t{draw.instance_keys} * draw.instances;
    }
    return {std::move(first_keys), end};
}

/// The transforms of an instance's vertices to view space.
struct InstanceSpace {
    const MeshInstance* instance = nullptr;
    glm::dmat3 linear{1}, normal{1};
    double scale = 1;  ///< length of a unit of the mesh

    void set(const MeshInstance& of, const glm::dmat3& view_from_world) {
        if (&of == instance) return;
        instance = &of;
        linear = view_from_world * glm::dmat3(of.world);
        const double determinant = glm::determinant(linear);
        normal = determinant != 0 ? glm::transpose(glm::inverse(linear)) : glm::dmat3(0);
        scale = std::cbrt(std::abs(determinant));
    }
};

/// Writes the records of hits.
class HitRecorder {
  public:
    /// `textured`: by material, whether its colour depends on texture coordinates or tangents.
    HitRecorder(const PosedScene& posed, const View& view, const std::vector<char>& textured)
        : posed_(posed),
          view_(view),
          textured_(textured),
          view_from_world_(glm::inverse(view.camera_to_world)),
          elements_(posed, true) {}

    shader::HitRecord recordOf(const ShadedHit& hit) {
        lookAt(glm::dvec2(hit.pixel) + hit.at);
        const WorldElement& element = elements_.at(hit.key).element;
        const SurfacePoint point = surfacePoint(posed_, element, ray_);
        const glm::dmat3 turn(view_from_world_);
        space_.set(*element.instance, turn);
        const Geometry geometry = point.geometry();
        shader::HitRecord record{};
        const glm::dvec3 world = element.weighted(point.weight);
        record.position = {glm::vec3(view_from_world_ * glm::dvec4(world, 1)), point.side};
        record.toward = {toward_, space_.scale};
        if (const auto& normals = posed_.normals(geometry); !normals.empty())
            record.normal = {glm::vec3(space_.normal * point.mean(normals)), 0};
        const bool has_normal = glm::vec3(record.normal) != glm::vec3(0);
        record.normal.w = static_cast<float>(hit.samples);
        const auto& colors = posed_.colors(geometry);
        record.color = colors.empty() ? glm::vec4(1) : glm::vec4(point.mean(colors));
        // The gradients are for textures, tangents, and the facet's normal.
        if (textured_[static_cast<std::size_t>(element.primitive->material)] || !has_normal)
            addGradients(surfacePoint(posed_, element, ray_, &change()), record);
        return record;
    }

  private:
    void addGradients(const SurfacePoint& point, shader::HitRecord& record) const {
        const glm::dmat3 turn(view_from_world_);
        if (const auto& tangents = posed_.tangents(point.geometry()); !tangents.empty()) {
            const glm::dvec4 tangent = point.mean(tangents);
            record.tangent = {glm::vec3(space_.linear * glm::dvec3(tangent)),
                              point.element.instance->mirrored ? -tangent.w : tangent.w};
        }
        const TextureFootprint first = point.footprint(0), second = point.footprint(1);
        record.texcoords = {point.texcoord(0), point.texcoord(1)};
        record.texcoords_dx = {first.per_x, second.per_x};
        record.texcoords_dy = {-first.per_y, -second.per_y};
        record.position_dx = {turn * point.element.weighted(point.weight_per[0]), 0};
        record.position_dy = {-turn * point.element.weighted(point.weight_per[1]), 0};
    }

    void lookAt(const glm::dvec2& point) {
        if (point == point_) return;
        point_ = point;
        ray_ = rayOf(view_, point);
        toward_ = -glm::normalize(glm::dmat3(view_from_world_) * ray_.direction);
        change_.reset();
    }

    const RayDifferentials& change() {
        if (!change_) change_ = differentialsOf(view_, point_);
        return *change_;
    }

    const PosedScene& posed_;
    const View& view_;
    const std::vector<char>& textured_;
    glm::dmat4 view_from_world_;
    RecentElements elements_;
    InstanceSpace space_;
    glm::dvec2 point_{-1};  ///< the point of the ray, in the picture
    Ray ray_;
    glm::vec3 toward_{0};  ///< unit vector against the ray, view space
    std::optional<RayDifferentials> change_;
};

}  // namespace

HitShader::HitShader(const gl::Context& context, const PosedScene& posed,
                     SceneRasterizer& rasterizer, const PassContext& pass_context)
    : context_(context),
      posed_(posed),
      rasterizer_(rasterizer),
      pass_context_(pass_context),
      draw_of_(drawsByKey(posed.drawList())) {
    for (Material material : posed.scene().materials) {
        const auto textures = texturesOf(material);
        textured_.push_back(std::ranges::any_of(textures,
                                                [](const MaterialTexture& texture) {
                                                    return texture.ref && *texture.ref;
                                                }) ||
                            material.anisotropy.strength != 0);
    }
}

std::uint64_t HitShader::bytes() {
    // The hits, their records, the colours (at most eight floats), and the places of hits.
    return kAtOnce * (sizeof(ShadedHit) + sizeof(shader::HitRecord) + 8 * sizeof(float) +
                      sizeof(std::uint32_t));
}

void HitShader::shade(std::span<const ShadedHit> hits, std::span<std::byte> colors,
                      std::size_t stride, const std::array<glm::dvec2, kPixelSamples>* positions) {
    if (hits.empty()) return;
    // Groups the hits by draw.
    std::vector<std::uint32_t> next_of(posed_.drawList().draws().size()), place(hits.size());
    for (std::size_t i = 0; i < hits.size(); ++i)
        ++next_of[place[i] = draw_of_.surfaceOf(hits[i].key)];
    std::vector<HitGroup> groups;
    std::uint32_t placed = 0;
    for (std::size_t draw = 0; draw < next_of.size(); ++draw) {
        const std::uint32_t count = std::exchange(next_of[draw], placed);
        if (count > 0) groups.push_back({draw, count});
        placed += count;
    }
    for (std::uint32_t& of_hit : place)
        of_hit = next_of[of_hit]++;

    const std::size_t room = std::max(hits.size(), kAtOnce);
    const std::size_t color_bytes = pass_context_.settings.storedColorBytes();
    gl::reserve(context_.functions(), records_, room * sizeof(shader::HitRecord));
    gl::reserve(context_.functions(), colors_, room * color_bytes);
    {
        const auto mapping = records_.overwrite(hits.size() * sizeof(shader::HitRecord));
        auto* const records = mapping.as<shader::HitRecord>();
        parallelFor((hits.size() + kHitsOfTask - 1) / kHitsOfTask, [&](std::size_t task) {
            HitRecorder recorder(posed_, pass_context_.view, textured_);
            const std::size_t begin = task * kHitsOfTask;
            for (std::size_t i = begin; i < std::min(hits.size(), begin + kHitsOfTask); ++i)
                records[place[i]] = recorder.recordOf(hits[i]);
        });
    }
    records_.bindStorage(PEELER_HITS);
    colors_.bindStorage(PEELER_HIT_COLORS);
    rasterizer_.shadeHits(groups, positions);
    gl::waitForGpu(context_.functions());
    gl::checkErrors(context_.functions(), "shading hits");
    const auto mapping = colors_.read(hits.size() * color_bytes);
    const auto* const shaded = mapping.as<const std::byte>();
    for (std::size_t i = 0; i < hits.size(); ++i)
        std::memcpy(colors.data() + i * stride, shaded + place[i] * color_bytes, stride);
}

}  // namespace peeler
