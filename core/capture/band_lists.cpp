// SPDX-License-Identifier: Apache-2.0
// The fragment lists of a band: drawing, copying from GPU memory, and sorting.
#include <algorithm>
#include <array>
#include <bit>
#include <limits>
#include <string>
#include <vector>

#include "core/base/parallel.h"
#include "core/base/resize_anew.h"
#include "core/base/stage_times.h"
#include "core/capture/band_capture.h"
#include "core/fragments/depth_sort.h"
#include "core/fragments/supersampling.h"
#include "core/fragments/surface_channels.h"
#include "core/image/channels.h"
#include "core/image/composite.h"
#include "core/image/layers.h"
#include "core/image/merge.h"
#include "core/splats/splat_channels.h"

namespace peeler {
namespace {

std::vector<std::string> colorChannels(const CaptureSettings& settings) {
    if (settings.hit_mode == HitMode::kNone) return colorNames(settings.tinted);
    if (settings.hit_mode == HitMode::kSloped) return {"dDepth.X", "dDepth.Y"};
    return {};
}

}  // namespace

int BandCapture::layers(LayerMethod& method, const BandRequest& request, LayeredImage& out) {
    if (pass_context_.view.rays) {
        const StageTimer timer(times_, "capture");
        const auto gpu = gl_->timer.span("gpuCapture");
        tracedLayers().capture(request.band, request.layers, request.keys != StoredKeys::kOrder,
                               next_frame_, out);
        tracedLayers().takeTimes();  // "capture" includes them
        return 1;
    }
    return showsSplats() ? layersWithSplats(method, request, out)
                         : surfaceLayers(method, request, out);
}

int BandCapture::captureHiding(LayerMethod& method, const Window& band) {
    SplatParts& parts = *splats_;
    if (parts.band == band) return parts.passes;
    LayeredImage& surfaces = parts.layers.front();
    countSurfaces(band, parts.surface_counts);
    parts.passes = surfaceLayers(
        method, {.band = band, .counts = parts.surface_counts, .keys = StoredKeys::kSurface},
        surfaces);
    parts.hidden_from = parts.shown.nearestOpaque(surfaces);
    parts.shown.keep(pass_context_.shown, false, surfaces);
    parts.band = band;
    return parts.passes;
}

int BandCapture::layersWithSplats(LayerMethod& method, const BandRequest& request,
                                  LayeredImage& out) {
    const Window& band = request.band;
    const CaptureSettings& settings = pass_context_.settings;
    SplatParts& parts = *splats_;
    auto& [surfaces, splats] = parts.layers;
    int passes = 0;
    const bool alone = posed_->drawList().draws().empty();
    if (hidesSplats()) passes = captureHiding(method, band);
    // The fragments are those of splats and those of surfaces.
    std::vector<std::uint32_t>& counts = parts.splat_counts;
    std::span<const std::uint32_t> of_splats = request.counts;
    if (!alone) {
        const StageTimer timer(times_, "splats");
        counts.assign(band.pixels(), 0);
        parts.splats.addCounts(band, counts, parts.hidden_from);
        of_splats = counts;
    }
    if (!alone && !hidesSplats()) {
        parts.surface_counts.assign(request.counts.begin(), request.counts.end());
        for (std::size_t pixel = 0; pixel < counts.size(); ++pixel)
            parts.surface_counts[pixel] -= counts[pixel];
        passes = surfaceLayers(
            method, {.band = band, .counts = parts.surface_counts, .keys = StoredKeys::kSurface},
            surfaces);
    }
    const StageTimer timer(times_, "splats");
    LayeredImage& captured = alone ? out : splats;
    parts.splats.capture(band, of_splats, captured, parts.hidden_from);
    fillSplatChannels(*posed_, pass_context_.view, settings.channels, next_frame_, captured);
    if (!alone) mergeByDepth(parts.layers, band, splats, out);
    keepLayers(out, {.nearest = request.layers});
    if (request.keys == StoredKeys::kOrder) out.extra.erase(out.extra.begin());
    return passes;
}

int BandCapture::surfaceLayers(LayerMethod& method, const BandRequest& request, LayeredImage& out) {
    if (!gl_) {  // there are no surfaces
        lists_.band = request.band;
        lists_.layers = request.layers;
        lists_.keys = request.keys;
        lists_.first.assign(request.band.pixels() + 1, 0);
        sortLists(lists_, nullptr, nullptr, out);
        return 0;
    }
    fillLists(method, request, request.layers);
    if (lists_.channels) {
        const StageTimer timer(times_, "capture");
        drawChannels(lists_);
        gl::waitForGpu(gl());
        gl::checkErrors(gl(), "capturing channels");
    }
    const StageTimer timer(times_, "sort");
    const auto stored = readFragments(lists_);
    if (!lists_.channels) {
        sortLists(lists_, stored.as<const std::uint32_t>(), nullptr, out);
    } else {
        const auto values = gl_->buffers.channels().read(shadedBytes(lists_));
        sortLists(lists_, stored.as<const std::uint32_t>(), values.as<const float>(), out);
    }
    return lists_.passes;
}

GlLayers BandCapture::layersOnGpu(LayerMethod& method, const BandRequest& request) {
    fillLists(method, request, request.layers);
    const StageTimer timer(times_, "sort");
    const auto gpu = gl_->timer.span("gpuCapture");
    const Window& band = request.band;
    const std::uint32_t limit = request.limit();
    std::vector<std::uint32_t> offsets(band.pixels() + 1);
    for (std::size_t p = 0; p < band.pixels(); ++p)
        offsets[p + 1] = offsets[p] + std::min(request.counts[p], limit);
    setListHeads(lists_.first);
    gl_->buffers.reserveLayers(offsets, pass_context_.settings.storedColorBytes());
    gl_->buffers.bindForSorting();
    gl_->rasterizer.setBand(band);
    const Projection& projection = pass_context_.view.projection;
    const auto planes =
        std::bit_cast<std::array<int, 4>>(std::array{projection.near, projection.far});
    forEachTile(band, [&](const Window& tile, const Window& area) {
        gl_->rasterizer.setTile(tile);
        gl_->rasterizer.compute("sort_lists.comp", projection.perspective ? "" : "ORTHOGRAPHIC",
                                area, planes);
    });
    gl().MemoryBarrier(GL_ALL_BARRIER_BITS);
    gl::checkErrors(gl(), "sorting fragments");
    return {.window = band,
            .fragments = offsets.back(),
            .layers = largestIn(band, band,
                                [&](std::size_t p) { return std::min(request.counts[p], limit); }),
            .color_type = pass_context_.settings.color_type,
            .tinted = pass_context_.settings.tinted,
            .counts = gl_->buffers.layerCounts().name(),
            .offsets = gl_->buffers.layerOffsets().name(),
            .depths = gl_->buffers.layerDepths().name(),
            .colors = gl_->buffers.layerColors().name()};
}

bool BandCapture::overlaps() const {
    return gl_ && !gl_->context.device().software && !ListHeadTarget::supported(gl_->context);
}

void BandCapture::submit(LayerMethod& method, const BandRequest& request, BandLists& lists) {
    const StageTimer timer(times_, "capture");
    drawLists(method, request, request.layers, lists);
    lists.copied_heads.copy(gl(), gl_->buffers.listHeads(),
                            request.band.pixels() * sizeof(std::uint32_t));
    if (lists.channels) {
        drawChannels(lists);
        lists.copied_channels.copy(gl(), gl_->buffers.channels(), shadedBytes(lists));
    }
    lists.copied_fragments.copy(gl(), gl_->buffers.fragments(), storedBytes(lists));
    lists.copied = gl::Fence(gl());
}

int BandCapture::take(BandLists& lists, LayeredImage& out) {
    {
        const StageTimer timer(times_, "capture");
        lists.copied.wait();
        gl::checkErrors(gl(), "capturing fragments");
    }
    const StageTimer timer(times_, "sort");
    checkListHeads(lists.copied_heads.as<std::uint32_t>(), lists.band, lists.first,
                   std::span(lists.first).subspan(1));
    sortLists(lists, lists.copied_fragments.as<std::uint32_t>(),
              lists.channels ? lists.copied_channels.as<float>() : nullptr, out);
    return lists.passes;
}

void BandCapture::sortLists(const BandLists& lists, const std::uint32_t* stored,
                            const float* values, LayeredImage& out) {
    out.window = lists.band;
    out.color.type = pass_context_.settings.hit_mode == HitMode::kSloped
                         ? PixelType::kFloat
                         : pass_context_.settings.color_type;
    out.color.channels = colorChannels(pass_context_.settings);
    const bool keyed = keysOf(lists.keys) != StoredKeys::kOrder;
    if (!keyed) out.extra.clear();
    std::vector<std::uint32_t> sources;
    const CapturedFragments captured = capturedIn(lists, stored);
    depthSort(captured, pass_context_.view.projection, lists.layers, out,
              keyed ? &sources : nullptr);
    if (keyed) addChannels(lists, captured, sources, values, out);
}

int BandCapture::composite(LayerMethod& method, const BandRequest& request, CompositeImage& out) {
    if (showsSplats() && !blendsTail() && posed_->drawList().draws().empty() &&
        splats_->splats.sameOrderEverywhere()) {
        const StageTimer timer(times_, "composite");
        splats_->splats.composite(request.band, request.layers, out);
        return 0;
    }
    if (pass_context_.view.rays || showsSplats()) {
        LayeredImage image;
        BandRequest all = request;
        if (blendsTail()) all.layers = 0;
        const int passes = layers(method, all, image);
        const StageTimer timer(times_, "composite");
        compositeNearest(image, request.layers, pass_context_.settings.tail, out);
        return passes;
    }
    const int passes = fillLists(method, request, blendsTail() ? 0 : request.layers);
    const StageTimer timer(times_, "composite");
    const auto stored = readFragments(lists_);
    out.window = request.band;
    depthSortComposite(
        capturedIn(lists_, stored.as<const std::uint32_t>()), pass_context_.view.projection,
        request.layers, pass_context_.settings.tail,
        {colorChannels(pass_context_.settings), pass_context_.settings.color_type, {}}, out);
    return passes;
}

StoredKeys BandCapture::keysOf(StoredKeys asked) const {
    const CaptureSettings& settings = pass_context_.settings;
    const bool primitives = settings.hit_mode != HitMode::kNone || !settings.channels.empty();
    return primitives ? StoredKeys::kPrimitive : asked;
}

std::size_t BandCapture::storedBytes(const BandLists& lists) const {
    return lists.first.back() *
           BandBuffers::fragmentWords(pass_context_.settings.storedColorBytes()) *
           sizeof(std::uint32_t);
}

std::size_t BandCapture::shadedBytes(const BandLists& lists) const {
    return lists.first.back() * shadedComponents(pass_context_.settings.channels) * sizeof(float);
}

gl::Buffer::Mapping BandCapture::readFragments(const BandLists& lists) const {
    return gl_->buffers.fragments().read(storedBytes(lists));
}

CapturedFragments BandCapture::capturedIn(const BandLists& lists,
                                          const std::uint32_t* stored) const {
    return {lists.first, stored,
            BandBuffers::fragmentWords(pass_context_.settings.storedColorBytes())};
}

int BandCapture::fillLists(LayerMethod& method, const BandRequest& request, std::uint32_t layers) {
    const StageTimer timer(times_, "capture");
    drawLists(method, request, layers, lists_);
    gl::waitForGpu(gl());
    gl::checkErrors(gl(), "capturing fragments");
    const std::span<const std::uint32_t> first(lists_.first), end = first.subspan(1);
    if (takesListHeadTarget(method)) {
        checkListHeads(ends_.data(), request.band, first, end);
    } else {
        const auto list_heads =
            gl_->buffers.listHeads().read(request.band.pixels() * sizeof(std::uint32_t));
        checkListHeads(list_heads.as<const std::uint32_t>(), request.band, first, end);
    }
    return lists_.passes;
}

void BandCapture::drawLists(LayerMethod& method, const BandRequest& request, std::uint32_t layers,
                            BandLists& lists) {
    const Window& band = request.band;
    const std::size_t pixels = band.pixels();
    const std::uint32_t limit =
        method.takesAll() || layers == 0 ? std::numeric_limits<std::uint32_t>::max() : layers;
    lists.band = band;
    lists.layers = request.layers;
    lists.keys = request.keys;
    lists.channels = shadedComponents(pass_context_.settings.channels) > 0;
    std::vector<std::uint32_t>& first = lists.first;
    first.resize(pixels + 1);
    first[0] = 0;
    for (std::size_t p = 0; p < pixels; ++p)
        first[p + 1] = first[p] + std::min(request.counts[p], limit);
    const std::size_t fragments = first[pixels];
    const bool target = takesListHeadTarget(method);
    prepareClip(band);
    const auto gpu = gl_->timer.span("gpuCapture");
    gl_->buffers.reserveFragments(
        fragments * BandBuffers::fragmentWords(pass_context_.settings.storedColorBytes()));
    if (target)
        ends_.assign(first.begin(), first.end() - 1);
    else
        setListHeads({first.data(), pixels});
    gl_->buffers.bindForLayers();
    gl_->rasterizer.setBand(band);
    lists.passes = 0;
    forEachTile(band, [&](const Window& tile, const Window& window) {
        LayerArea area{.window = window, .keys = keysOf(request.keys)};
        area.layers =
            largestIn(band, window, [&](std::size_t p) { return first[p + 1] - first[p]; });
        if (area.layers == 0) return;
        gl_->rasterizer.setTile(tile);
        if (target) gl_->list_head_target.write(gl(), tile, window, band, first);
        area.list_head_target = target;
        area.in_front = request.in_front;
        area.framebuffer = target ? gl_->list_head_target.framebuffer() : 0;
        gl::Framebuffer with_depths;
        if (request.in_front) {
            with_depths = framebufferInFront();
            area.framebuffer = with_depths.name();
        }
        lists.passes += method.capture(gl_->rasterizer, area);
        if (target) gl_->list_head_target.read(gl(), tile, window, band, ends_);
    });
}

void BandCapture::drawChannels(BandLists& lists) {
    const std::size_t fragments = lists.first.back();
    const std::size_t components = shadedComponents(pass_context_.settings.channels);
    const auto gpu = gl_->timer.span("gpuCapture");
    gl_->buffers.clearForChannels(std::max<std::size_t>(fragments, 1) * components);
    setListHeads(std::span(lists.first).subspan(1));
    gl_->buffers.bindForLayers();
    forEachTile(lists.band, [&](const Window& tile, const Window& area) {
        gl_->rasterizer.setTile(tile);
        const auto framebuffer = gl::makeEmptyFramebuffer(gl(), tile.width(), tile.height());
        gl_->rasterizer.draw({.fragment_shader = "channels.frag",
                              .describes = true,
                              .bounded = false,
                              .framebuffer = framebuffer.name(),
                              .argument = {{static_cast<int>(components), 0, 0, 0}}},
                             area);
    });
    ++lists.passes;
}

void BandCapture::addChannels(const BandLists& lists, const CapturedFragments& captured,
                              std::span<std::uint32_t> sources, const float* values,
                              LayeredImage& out) {
    const std::vector<Channel>& channels = pass_context_.settings.channels;
    const bool hits = pass_context_.settings.hit_mode != HitMode::kNone;
    const bool keyed = hits || lists.keys != StoredKeys::kOrder;
    out.extra.resize(channels.size() + (keyed ? 1 : 0));
    FragmentArray not_asked_for;
    FragmentArray& first = keyed ? out.extra.front() : not_asked_for;
    first.channels = {kKeyChannel};
    first.type = PixelType::kUint;
    resizeAnew(first.data, sources.size() * sizeof(std::uint32_t));
    const std::span<std::uint32_t> keys = first.as<std::uint32_t>();
    constexpr std::size_t kAtOnce = std::size_t{1} << 16;
    parallelFor((sources.size() + kAtOnce - 1) / kAtOnce, [&](std::size_t part) {
        const std::size_t end = std::min((part + 1) * kAtOnce, sources.size());
        for (std::size_t i = part * kAtOnce; i < end; ++i)
            keys[i] = captured.key(sources[i]);
    });

    const FragmentSources from{*posed_, pass_context_.view, next_frame_, keys, sources, values};
    const std::span<FragmentArray> arrays = std::span(out.extra).last(channels.size());
    if (pass_context_.settings.hit_mode != HitMode::kRefined)
        return fillChannels(from, channels, out, arrays);
    const double correction = refineHits(from, channels, out, keys, sources, arrays);
    largest_correction_ = std::max(largest_correction_, correction);
}

}  // namespace peeler
