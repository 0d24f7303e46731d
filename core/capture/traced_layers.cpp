// SPDX-License-Identifier: Apache-2.0
#include "core/capture/traced_layers.h"

#include <algorithm>
#include <cmath>
#include <cstring>
#include <numeric>
#include <utility>

#include "core/base/parallel.h"
#include "core/base/resize_anew.h"
#include "core/fragments/surface_channels.h"
#include "core/gl/objects.h"
#include "core/image/channels.h"
#include "core/image/layers.h"
#include "core/raster/surface_points.h"
#include "core/raster/surface_values.h"
#include "core/scene/elements.h"
#include "core/scene/view.h"
#include "shaders/interface.glsl"

namespace peeler {
namespace {

constexpr std::size_t kHitsAtOnce = std::size_t{1} << 17;     // hits shaded at once
constexpr std::size_t kCountedPixels = std::size_t{1} << 16;  // pixels counted at once
constexpr std::size_t kPixelsOfTask = 512;                    // pixels of a parallel task

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

/// Returns the settings with which hits are found.
CaptureSettings hitSettings(const CaptureSettings& asked) {
    CaptureSettings settings;
    settings.hit_mode = HitMode::kRaw;
    settings.faces = asked.faces;
    settings.depth_clamp = asked.depth_clamp;
    settings.memory = asked.memory;
    settings.band_bytes = asked.band_bytes;
    return settings;
}

bool sameRays(const View& a, const View& b) {
    return a.rays == b.rays && a.camera_to_world == b.camera_to_world && a.width == b.width &&
           a.height == b.height && a.crop == b.crop && a.projection.near == b.projection.near &&
           a.projection.far == b.projection.far;
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
    HitRecorder(const PosedScene& posed, const View& view)
        : posed_(posed),
          view_(view),
          view_from_world_(glm::inverse(view.camera_to_world)),
          elements_(posed, true) {}

    /// Starts with the hits of a pixel.
    void begin(const glm::ivec2& pixel) {
        const glm::dvec2 at = glm::dvec2(pixel) + view_.sample;
        ray_ = rayOf(view_, at);
        change_ = differentialsOf(view_, at);
    }

    shader::HitRecord recordOf(std::uint32_t key) {
        const WorldElement& element = elements_.at(key).element;
        const SurfacePoint point = surfacePoint(posed_, element, ray_, &change_);
        const glm::dmat3 turn(view_from_world_);
        space_.set(*element.instance, turn);
        const Geometry geometry = point.geometry();
        shader::HitRecord record{};
        const glm::dvec3 world = element.weighted(point.weight);
        record.position = {glm::vec3(view_from_world_ * glm::dvec4(world, 1)), point.side};
        record.toward = {glm::vec3(-glm::normalize(turn * ray_.direction)), space_.scale};
        if (const auto& normals = posed_.normals(geometry); !normals.empty())
            record.normal = {glm::vec3(space_.normal * point.mean(normals)), 0};
        if (const auto& tangents = posed_.tangents(geometry); !tangents.empty()) {
            const glm::dvec4 tangent = point.mean(tangents);
            record.tangent = {glm::vec3(space_.linear * glm::dvec3(tangent)),
                              element.instance->mirrored ? -tangent.w : tangent.w};
        }
        const auto& colors = posed_.colors(geometry);
        record.color = colors.empty() ? glm::vec4(1) : glm::vec4(point.mean(colors));
        const TextureFootprint first = point.footprint(0), second = point.footprint(1);
        record.texcoords = {point.texcoord(0), point.texcoord(1)};
        record.texcoords_dx = {first.per_x, second.per_x};
        record.texcoords_dy = {-first.per_y, -second.per_y};
        record.position_dx = {turn * element.weighted(point.weight_per[0]), 0};
        record.position_dy = {-turn * element.weighted(point.weight_per[1]), 0};
        return record;
    }

  private:
    const PosedScene& posed_;
    const View& view_;
    glm::dmat4 view_from_world_;
    RecentElements elements_;
    InstanceSpace space_;
    Ray ray_;
    RayDifferentials change_;
};

}  // namespace

TracedLayers::TracedLayers(const gl::Context& context, PosedScene posed,
                           SceneRasterizer& rasterizer, const PassContext& pass_context)
    : context_(context),
      posed_(std::move(posed)),
      rasterizer_(rasterizer),
      pass_context_(pass_context),
      hits_(posed_),
      levels_(posed_.scene()),
      shown_(posed_),
      draw_of_(drawsByKey(posed_.drawList())) {}

std::uint64_t TracedLayers::bufferBytes() {
    // The records, the colours (at most eight floats), and the places of hits and draws.
    return kHitsAtOnce *
           (sizeof(shader::HitRecord) + 8 * sizeof(float) + 2 * sizeof(std::uint32_t));
}

const CapturePlan& TracedLayers::planOf(const View& view) {
    const CaptureSettings settings = hitSettings(pass_context_.settings);
    if (!traced_.empty() &&
        (!sameRays(traced_.front().view, view) || settings.faces != traced_settings_.faces ||
         settings.depth_clamp != traced_settings_.depth_clamp))
        traced_.clear();
    traced_settings_ = settings;
    for (const Traced& traced : traced_)
        if (traced.view.sample == view.sample) return traced.plan;
    traced_.push_back({view, hits_.plan(view, settings)});
    return traced_.back().plan;
}

/// Finds the hits of a band that the settings select.
void TracedLayers::findHits(const Window& band, LayeredImage& out) {
    hits_.captureBand(planOf(pass_context_.view), band, out);
    shown_.keep(pass_context_.settings.surfaces, pass_context_.settings.opaque_only, out);
}

void TracedLayers::count(const Window& band, std::vector<std::uint32_t>& counts) {
    counts.clear();
    counts.reserve(band.pixels());
    const int rows = std::max(1, static_cast<int>(kCountedPixels) / band.width());
    LayeredImage image;
    for (int y = band.y0; y < band.y1; y += rows) {
        findHits({band.x0, y, band.x1, std::min(band.y1, y + rows)}, image);
        for (std::size_t pixel = 0; pixel < image.window.pixels(); ++pixel)
            counts.push_back(image.count(pixel));
    }
}

void TracedLayers::capture(const Window& band, std::uint32_t layers, bool keys,
                           const NextFrame* next, LayeredImage& out) {
    const CaptureSettings& settings = pass_context_.settings;
    findHits(band, out);
    keepLayers(out, {.nearest = layers});
    out.color = {colorNames(settings.tinted), settings.color_type, std::move(out.color.data)};
    resizeAnew(out.color.data, out.fragments() * out.color.stride());
    shade(out);
    out.extra.resize(1 + settings.channels.size());
    if (!settings.channels.empty())
        fillHitChannels(posed_, pass_context_.view, settings.channels, settings.color_type, out,
                        &levels_, next);
    if (!keys) out.extra.erase(out.extra.begin());
}

/// Sets the colours of all hits of an image.
void TracedLayers::shade(LayeredImage& image) {
    for (std::size_t first = 0, end = 0; first < image.window.pixels(); first = end) {
        // Shades as many pixels as fit, at least one.
        const auto last = image.offsets.begin() + static_cast<std::ptrdiff_t>(first);
        const auto beyond = std::upper_bound(last + 1, image.offsets.end(),
                                             image.offsets[first] + std::uint32_t{kHitsAtOnce});
        end = std::max(first + 1, static_cast<std::size_t>(beyond - image.offsets.begin()) - 1);
        if (image.offsets[end] > image.offsets[first]) shadePixels(image, first, end);
    }
}

/// Sets the colours of the hits of the pixels from `first` up to `end`.
void TracedLayers::shadePixels(LayeredImage& image, std::size_t first, std::size_t end) {
    const std::span<const std::uint32_t> keys = image.extra.front().as<std::uint32_t>();
    const std::size_t from = image.offsets[first], hits = image.offsets[end] - from;

    // Groups the hits by draw.
    std::vector<std::uint32_t> next_of(posed_.drawList().draws().size()), place(hits);
    for (std::size_t i = 0; i < hits; ++i)
        ++next_of[place[i] = draw_of_.surfaceOf(keys[from + i])];
    std::vector<HitGroup> groups;
    std::uint32_t placed = 0;
    for (std::size_t draw = 0; draw < next_of.size(); ++draw) {
        const std::uint32_t count = std::exchange(next_of[draw], placed);
        if (count > 0) groups.push_back({draw, count});
        placed += count;
    }
    for (std::uint32_t& of_hit : place)
        of_hit = next_of[of_hit]++;

    const std::size_t room = std::max(hits, kHitsAtOnce);
    const std::size_t color_bytes = pass_context_.settings.storedColorBytes();
    const auto reserve = [&](gl::Buffer& buffer, std::size_t bytes) {
        if (buffer.size() >= bytes) return;
        buffer = {};
        buffer = gl::Buffer(context_.functions(), bytes);
    };
    reserve(records_, room * sizeof(shader::HitRecord));
    reserve(colors_, room * color_bytes);
    {
        const auto mapping = records_.overwrite(hits * sizeof(shader::HitRecord));
        auto* const records = mapping.as<shader::HitRecord>();
        const auto width = static_cast<std::size_t>(image.window.width());
        parallelFor((end - first + kPixelsOfTask - 1) / kPixelsOfTask, [&](std::size_t task) {
            HitRecorder recorder(posed_, pass_context_.view);
            const std::size_t begin = first + task * kPixelsOfTask;
            for (std::size_t p = begin; p < std::min(end, begin + kPixelsOfTask); ++p) {
                if (image.count(p) == 0) continue;
                recorder.begin({image.window.x0 + static_cast<int>(p % width),
                                image.window.y0 + static_cast<int>(p / width)});
                for (std::size_t i = image.offsets[p]; i < image.offsets[p + 1]; ++i)
                    records[place[i - from]] = recorder.recordOf(keys[i]);
            }
        });
    }
    records_.bindStorage(PEELER_HITS);
    colors_.bindStorage(PEELER_HIT_COLORS);
    rasterizer_.shadeHits(groups);
    gl::waitForGpu(context_.functions());
    gl::checkErrors(context_.functions(), "shading hits");
    const auto mapping = colors_.read(hits * color_bytes);
    const auto* const colors = mapping.as<const std::byte>();
    const std::size_t stride = image.color.stride();
    for (std::size_t i = 0; i < hits; ++i)
        std::memcpy(image.color.data.data() + (from + i) * stride, colors + place[i] * color_bytes,
                    stride);
}

}  // namespace peeler
