// SPDX-License-Identifier: Apache-2.0
#include "core/capture/band_capture.h"

#include <algorithm>
#include <array>
#include <limits>
#include <numeric>

#include <peeler/error.h>
#include "core/base/parallel.h"
#include "core/base/resize_anew.h"
#include "core/base/stage_times.h"
#include "core/fragments/supersampling.h"
#include "core/image/channels.h"
#include "core/image/composite.h"

namespace peeler {

BandCapture::GlParts::GlParts(gl::Context& gl_context, const PosedScene& posed,
                              const PassContext& pass_context, StageTimes& times)
    : context(gl_context),
      timer(gl_context),
      scene(timed(times, "upload", [&] { return GpuScene(gl_context, posed); })),
      rasterizer(gl_context, scene, pass_context),
      buffers(gl_context.functions()) {}

BandCapture::BandCapture(gl::Context* context, const PosedScene& posed,
                         const PassContext& pass_context, StageTimes& times)
    : pass_context_(pass_context), times_(times), posed_(&posed) {
    if (context) gl_.emplace(*context, posed, pass_context, times);
    if (peeler::hasSplats(posed)) splats_.emplace(posed);
}

void BandCapture::begin() {
    clip_band_ = {};
    largest_correction_ = 0;
    if (gl_) gl_->rasterizer.begin();
    if (!splats_) return;
    splats_->splats.begin(pass_context_.view, pass_context_.settings);
    splats_->band = {};
    splats_->hidden_from.clear();
}

void BandCapture::setPose(const PosedScene& posed) {
    posed_ = &posed;
    if (splats_) splats_.emplace(posed);
    if (!gl_) return;
    gl_->traced.reset();
    gl_->samples.reset();
    gl_->scene.setPose(posed);
}

void BandCapture::free() {
    opaque_pixels_ = {};
    visible_ = {};
    clip_band_ = {};
    if (splats_) {
        splats_->layers = {};
        splats_->band = {};
    }
    if (!gl_) return;
    gl_->buffers.free();
    gl_->list_head_target.free();
    gl_->opaque.free();
    if (gl_->samples) gl_->samples->free();
    gl_->rasterizer.freeBound();
}

std::uint64_t BandCapture::fragmentBytes() const {
    return BandBuffers::fragmentWords(pass_context_.settings.storedColorBytes()) *
               sizeof(std::uint32_t) +
           shadedComponents(pass_context_.settings.channels) * sizeof(float);
}

std::uint64_t BandCapture::pixelBytes() const {
    return BandBuffers::compositeBytes(pass_context_.settings.tinted);
}

std::uint64_t BandCapture::mostBufferBytes() const {
    return gl_ ? static_cast<std::uint64_t>(gl_->context.device().limits.shader_storage_block_size)
               : std::numeric_limits<std::uint64_t>::max();
}

std::uint64_t BandCapture::tilePixels() const {
    std::uint64_t largest = 0;
    if (!gl_) return largest;
    for (const Window& tile : gl_->rasterizer.tilesOf(pass_context_.view.crop))
        largest = std::max(largest, tile.pixels());
    return largest;
}

void BandCapture::drawIntoLists(const GeometryPass& pass, const Window& band) {
    gl_->buffers.bindForLayers();
    gl_->rasterizer.setBand(band);
    forEachTile(band, [&](const Window& tile, const Window& area) {
        gl_->rasterizer.setTile(tile);
        const auto framebuffer = gl::makeEmptyFramebuffer(gl(), tile.width(), tile.height());
        GeometryPass into_lists = pass;
        into_lists.framebuffer = framebuffer.name();
        gl_->rasterizer.draw(into_lists, area);
    });
    gl::waitForGpu(gl());
    gl::checkErrors(gl(), "counting fragments");
}

void BandCapture::countInLists(const GeometryPass& pass, const Window& band,
                               std::vector<std::uint32_t>& counts) {
    const std::size_t pixels = band.pixels(), bytes = pixels * sizeof(std::uint32_t);
    gl_->buffers.reserveListHeads(pixels);
    gl_->buffers.listHeads().clearToZero(bytes);
    drawIntoLists(pass, band);
    const auto mapping = gl_->buffers.listHeads().read(bytes);
    const auto* list_heads = mapping.as<const std::uint32_t>();
    counts.assign(list_heads, list_heads + pixels);
}

void BandCapture::countClip(const Window& band, std::vector<std::uint32_t>& counts) {
    countInLists({.fragment_shader = "clip_boundary.frag",
                  .definitions = "COUNT",
                  .draws = Draws::kClipMeshes,
                  .bounded = false},
                 band, counts);
}

void BandCapture::prepareClip(const Window& band) {
    if (pass_context_.settings.clip.nodes.empty() || band == clip_band_) return;
    std::vector<std::uint32_t> first;
    countClip(band, first);
    const std::size_t pixels = band.pixels();
    first.insert(first.begin(), 0);
    std::partial_sum(first.begin(), first.end(), first.begin());
    gl_->buffers.reserveClip(first);
    setListHeads({first.data(), pixels});
    drawIntoLists({.fragment_shader = "clip_boundary.frag",
                   .draws = Draws::kClipMeshes,
                   .bounded = false,
                   .argument = {{static_cast<int>(first[pixels]), 0, 0, 0}}},
                  band);
    clip_band_ = band;
}

TracedLayers& BandCapture::tracedLayers() {
    if (!gl_->traced) gl_->traced.emplace(gl_->context, *posed_, gl_->rasterizer, pass_context_);
    return *gl_->traced;
}

void BandCapture::count(const Window& band, std::vector<std::uint32_t>& counts) {
    if (pass_context_.view.rays) {
        tracedLayers().count(band, counts);
        return add(times_, tracedLayers().takeTimes());
    }
    if (!showsSplats()) return countSurfaces(band, counts);
    if (hidesSplats()) {
        const MethodInfo& method = peelMethods().front();
        captureHiding(*method.layers(), band);
        // Other methods capture the surfaces themselves.
        if (pass_context_.settings.method != method.name) splats_->band = {};
        counts.resize(band.pixels());
        for (std::size_t pixel = 0; pixel < counts.size(); ++pixel)
            counts[pixel] = splats_->layers.front().count(pixel);
    } else {
        countSurfaces(band, counts);
    }
    const StageTimer timer(times_, "count");
    splats_->splats.addCounts(band, counts, splats_->hidden_from);
}

std::uint32_t BandCapture::surfaceOf(std::uint32_t key) const {
    constexpr std::uint32_t kSplat = std::uint32_t{1} << 31;
    const PosedScene& posed = *posed_;
    const DrawList& list = posed.drawList();
    const std::uint32_t index = list.surfaceOf(key);
    if (!splats_) return index;
    const DrawnSurface& surface = list.surfaces()[index];
    const Primitive& primitive =
        posed.primitives(posed.meshes()[surface.instance])[surface.primitive];
    return primitive.splats ? key | kSplat : index;
}

/// Counts the fragments of surfaces, lines and points.
void BandCapture::countSurfaces(const Window& band, std::vector<std::uint32_t>& counts) {
    if (posed_->drawList().draws().empty()) return counts.assign(band.pixels(), 0);
    const StageTimer timer(times_, "count");
    prepareClip(band);
    const auto gpu = gl_->timer.span("gpuCount");
    if (!ListHeadTarget::supported(gl_->context)) {
        countInLists({.fragment_shader = "count.frag"}, band, counts);
        return;
    }
    counts.resize(band.pixels());
    gl_->buffers.bindForLayers();
    gl_->rasterizer.setBand(band);
    forEachTile(band, [&](const Window& tile, const Window& area) {
        gl_->rasterizer.setTile(tile);
        gl_->list_head_target.write(gl(), tile, area, band, {});
        gl_->rasterizer.draw({.fragment_shader = "count.frag",
                              .definitions = kFetchedListHeads,
                              .framebuffer = gl_->list_head_target.framebuffer()},
                             area);
        gl_->list_head_target.read(gl(), tile, area, band, counts);
    });
    gl::checkErrors(gl(), "counting fragments");
}

/// Throws Error (kInternal) unless the capture advanced every pixel's list head from `first` to
/// exactly `end`.
void BandCapture::checkListHeads(const std::uint32_t* list_heads, const Window& band,
                                 std::span<const std::uint32_t> first,
                                 std::span<const std::uint32_t> end) const {
    for (std::size_t p = 0; p < band.pixels(); ++p) {
        if (list_heads[p] == end[p]) continue;
        const auto width = static_cast<std::size_t>(band.width());
        const std::string pixel = std::to_string(band.x0 + static_cast<int>(p % width)) + ", " +
                                  std::to_string(band.y0 + static_cast<int>(p / width));
        const std::uint32_t begin = first.empty() ? 0 : first[p];
        throw Error(ErrorKind::kInternal,
                    "method " + pass_context_.settings.method + " captured " +
                        std::to_string(list_heads[p] - begin) + " fragments, but " +
                        std::to_string(end[p] - begin) + " were counted",
                    "pixel " + pixel, "please report this with the scene and the GL renderer");
    }
}

void BandCapture::setListHeads(std::span<const std::uint32_t> list_heads) {
    gl_->buffers.reserveListHeads(list_heads.size());
    const auto mapping = gl_->buffers.listHeads().overwrite(list_heads.size_bytes());
    std::copy(list_heads.begin(), list_heads.end(), mapping.as<std::uint32_t>());
}

int BandCapture::composite(CompositeMethod& method, const BandRequest& request,
                           CompositeImage& out) {
    const StageTimer timer(times_, "capture");
    const Window& band = request.band;
    const std::uint32_t limit = request.limit();
    prepareClip(band);
    const auto gpu = gl_->timer.span("gpuCapture");
    gl_->buffers.clearForComposite(request.counts, pass_context_.settings.tinted);
    gl_->buffers.bindForComposite();
    gl_->rasterizer.setBand(band, limit);
    int passes = 0;
    forEachTile(band, [&](const Window& tile, const Window& window) {
        CompositeArea area;
        area.window = window;
        area.deepest = largestIn(band, window, [&](std::size_t p) { return request.counts[p]; });
        if (area.deepest == 0) return;
        area.layers = std::min(area.deepest, limit);
        area.tail = blendsTail() && area.deepest > area.layers;
        area.layersMissing = [&] {
            gl::waitForGpu(gl());
            const auto list_heads =
                gl_->buffers.listHeads().read(band.pixels() * sizeof(std::uint32_t));
            const auto* done = list_heads.as<const std::uint32_t>();
            return largestIn(band, window, [&](std::size_t p) {
                const std::uint32_t wanted = std::min(request.counts[p], limit);
                return done[p] == wanted ? 0 : wanted;
            });
        };
        gl_->rasterizer.setTile(tile);
        passes += method.composite(gl_->rasterizer, area);
    });
    gl::waitForGpu(gl());
    gl::checkErrors(gl(), "compositing fragments");
    readComposite(request, out);
    return passes;
}

void BandCapture::readComposite(const BandRequest& request, CompositeImage& out) {
    const std::size_t pixels = request.band.pixels();
    {
        std::vector<std::uint32_t> expected(request.counts.begin(), request.counts.end());
        if (!blendsTail()) {
            for (std::uint32_t& count : expected)
                count = std::min(count, request.limit());
        }
        const auto list_heads = gl_->buffers.listHeads().read(pixels * sizeof(std::uint32_t));
        checkListHeads(list_heads.as<const std::uint32_t>(), request.band, {}, expected);
    }
    const auto depths = gl_->buffers.depths().read(pixels * sizeof(float));
    const std::size_t records = pass_context_.settings.tinted ? 2 : 1;
    const auto colors = gl_->buffers.colors().read(pixels * records * 4 * sizeof(float));
    const auto* depth = depths.as<const float>();
    const auto* color = colors.as<const std::array<float, 4>>();
    out.window = request.band;
    // Pixels without fragments get default values. Capture methods do not write these pixels, so
    // the buffers may hold values of an earlier band there.
    out.rgba.assign(pixels, {});
    out.opacity.assign(pass_context_.settings.tinted ? pixels : 0, {});
    out.z.assign(pixels, std::numeric_limits<float>::infinity());
    for (std::size_t p = 0; p < pixels; ++p) {
        if (request.counts[p] == 0) continue;
        out.rgba[p] = color[records * p];
        if (out.tinted()) {
            const auto& [r, g, b, unused] = color[records * p + 1];
            out.opacity[p] = {r, g, b};
            out.rgba[p][3] = meanOpacity(r, g, b);
        }
        const double z = pass_context_.view.projection.linearZ(static_cast<double>(depth[p]));
        out.z[p] = static_cast<float>(z);
    }
}

}  // namespace peeler
