// SPDX-License-Identifier: Apache-2.0
#include "core/capture/traced_layers.h"

#include <algorithm>
#include <utility>

#include "core/base/resize_anew.h"
#include "core/fragments/surface_channels.h"
#include "core/image/channels.h"
#include "core/image/layers.h"
#include "core/raster/surface_values.h"

namespace peeler {
namespace {

constexpr std::size_t kCountedPixels = std::size_t{1} << 16;  // pixels counted at once

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

}  // namespace

TracedLayers::TracedLayers(const gl::Context& context, PosedScene posed,
                           SceneRasterizer& rasterizer, const PassContext& pass_context)
    : posed_(std::move(posed)),
      pass_context_(pass_context),
      hits_(posed_),
      levels_(posed_.scene()),
      shown_(posed_),
      shader_(context, posed_, rasterizer, pass_context) {}

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
    const std::span<const std::uint32_t> keys = image.extra.front().as<std::uint32_t>();
    const auto width = static_cast<std::size_t>(image.window.width());
    std::vector<ShadedHit> hits;
    for (std::size_t first = 0, end = 0; first < image.window.pixels(); first = end) {
        hits.clear();
        for (; end < image.window.pixels() && hits.size() < HitShader::kAtOnce; ++end) {
            const glm::ivec2 pixel(image.window.x0 + static_cast<int>(end % width),
                                   image.window.y0 + static_cast<int>(end / width));
            for (std::size_t i = image.offsets[end]; i < image.offsets[end + 1]; ++i)
                hits.push_back({pixel, pass_context_.view.sample, 1, keys[i]});
        }
        const std::size_t stride = image.color.stride();
        shader_.shade(
            hits, {image.color.data.data() + image.offsets[first] * stride, hits.size() * stride},
            stride);
    }
}

}  // namespace peeler
