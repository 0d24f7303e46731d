// SPDX-License-Identifier: Apache-2.0
#include "core/capture/band_capture.h"

#include <algorithm>
#include <array>
#include <limits>
#include <numeric>

#include "core/base/error.h"
#include "core/base/parallel.h"
#include "core/base/resize_anew.h"
#include "core/capture/captured_fragments.h"
#include "core/capture/supersampling.h"

namespace peeler {
namespace {

constexpr std::uint32_t kNoLimit = 0xFFFFFFFFU;

std::uint32_t limitOf(const BandRequest& request) {
    return request.layers ? request.layers : kNoLimit;
}

std::vector<std::string> colorChannels(const CaptureSettings& settings) {
    if (settings.hit_mode == HitMode::kNone) return colorNames(settings.tinted);
    if (settings.hit_mode == HitMode::kSloped) return {"dDepth.X", "dDepth.Y"};
    return {};
}

/// The largest value of the pixels of `area`, which lies in `band`.
template <class Value>
std::uint32_t largestIn(const Window& band, const Window& area, Value&& value) {
    std::uint32_t most = 0;
    for (int y = area.y0; y < area.y1; ++y) {
        const auto row =
            static_cast<std::size_t>(y - band.y0) * static_cast<std::size_t>(band.width());
        for (int x = area.x0; x < area.x1; ++x)
            most = std::max(most, value(row + static_cast<std::size_t>(x - band.x0)));
    }
    return most;
}

}  // namespace

BandCapture::BandCapture(gl::Context& context, const PosedScene& posed, const Shot& shot,
                         StageTimes& times)
    : context_(context),
      shot_(shot),
      times_(times),
      gpu_scene_(timed(times, "upload", [&] { return GpuScene(context, posed); })),
      rasterizer_(context, gpu_scene_, shot),
      buffers_(context.functions()) {}

void BandCapture::begin() {
    clip_band_ = {};
    largest_correction_ = 0;
    rasterizer_.begin();
}

void BandCapture::setPose(const PosedScene& posed) {
    gpu_scene_.setPose(posed);
}

void BandCapture::free() {
    buffers_.free();
    slot_target_.free();
    opaque_.free();
    opaque_pixels_ = {};
    visible_ = {};
    rasterizer_.freeBound();
    clip_band_ = {};
}

std::uint64_t BandCapture::fragmentBytes() const {
    return BandBuffers::fragmentWords(shot_.settings.storedColorBytes()) * sizeof(std::uint32_t) +
           shadedComponents(shot_.settings.channels) * sizeof(float);
}

std::uint64_t BandCapture::pixelBytes() const {
    return BandBuffers::compositeBytes(shot_.settings.tinted);
}

std::uint64_t BandCapture::tilePixels() const {
    std::uint64_t largest = 0;
    for (const Window& tile : rasterizer_.tilesOf(shot_.view.crop))
        largest = std::max(largest, tile.pixels());
    return largest;
}

void BandCapture::drawIntoSlots(const GeometryPass& pass, const Window& band) {
    buffers_.bindForLayers();
    rasterizer_.setBand(band);
    forEachTile(band, [&](const Window& tile, const Window& area) {
        rasterizer_.setTile(tile);
        const auto framebuffer = gl::makeEmptyFramebuffer(gl(), tile.width(), tile.height());
        GeometryPass into_slots = pass;
        into_slots.framebuffer = framebuffer.name();
        rasterizer_.draw(into_slots, area);
    });
    gl::waitForGpu(gl());
    gl::checkErrors(gl(), "counting fragments");
}

void BandCapture::countInSlots(const GeometryPass& pass, const Window& band,
                               std::vector<std::uint32_t>& counts) {
    const std::size_t pixels = band.pixels(), bytes = pixels * sizeof(std::uint32_t);
    buffers_.reserveSlots(pixels);
    buffers_.slots().clearToZero(bytes);
    drawIntoSlots(pass, band);
    const auto mapping = buffers_.slots().read(bytes);
    const auto* slots = mapping.as<const std::uint32_t>();
    counts.assign(slots, slots + pixels);
}

void BandCapture::countClip(const Window& band, std::vector<std::uint32_t>& counts) {
    countInSlots({.fragment_shader = "clip_boundary.frag",
                  .definitions = "COUNT",
                  .draws = Draws::kClipMeshes,
                  .bounded = false},
                 band, counts);
}

void BandCapture::prepareClip(const Window& band) {
    if (shot_.settings.clip.nodes.empty() || band == clip_band_) return;
    std::vector<std::uint32_t> first;
    countClip(band, first);
    const std::size_t pixels = band.pixels();
    first.insert(first.begin(), 0);
    std::partial_sum(first.begin(), first.end(), first.begin());
    buffers_.reserveClip(first);
    setSlots({first.data(), pixels});
    drawIntoSlots({.fragment_shader = "clip_boundary.frag",
                   .draws = Draws::kClipMeshes,
                   .bounded = false,
                   .argument = {{static_cast<int>(first[pixels]), 0, 0, 0}}},
                  band);
    clip_band_ = band;
}

void BandCapture::count(const Window& band, std::vector<std::uint32_t>& counts) {
    const StageTimer timer(times_, "count");
    prepareClip(band);
    if (!SlotTarget::supported(context_)) {
        countInSlots({.fragment_shader = "count.frag"}, band, counts);
        return;
    }
    counts.resize(band.pixels());
    buffers_.bindForLayers();
    rasterizer_.setBand(band);
    forEachTile(band, [&](const Window& tile, const Window& area) {
        rasterizer_.setTile(tile);
        slot_target_.write(gl(), tile, area, band, {});
        rasterizer_.draw({.fragment_shader = "count.frag",
                          .definitions = kFetchedSlots,
                          .framebuffer = slot_target_.framebuffer()},
                         area);
        slot_target_.read(gl(), tile, area, band, counts);
    });
    gl::checkErrors(gl(), "counting fragments");
}

/// The completeness certificate: the capture advanced every pixel's slot from `first` exactly to
/// `end`.
void BandCapture::checkSlots(const std::uint32_t* slots, const Window& band,
                             std::span<const std::uint32_t> first,
                             std::span<const std::uint32_t> end) const {
    for (std::size_t p = 0; p < band.pixels(); ++p) {
        if (slots[p] == end[p]) continue;
        const auto width = static_cast<std::size_t>(band.width());
        const std::string pixel = std::to_string(band.x0 + static_cast<int>(p % width)) + ", " +
                                  std::to_string(band.y0 + static_cast<int>(p / width));
        const std::uint32_t begin = first.empty() ? 0 : first[p];
        throw Error(ErrorKind::kInternal,
                    "method " + shot_.settings.method + " captured " +
                        std::to_string(slots[p] - begin) + " fragments where " +
                        std::to_string(end[p] - begin) + " were counted",
                    "pixel " + pixel, "please report this with the scene and the GL renderer");
    }
}

int BandCapture::layers(LayerMethod& method, const BandRequest& request, LayeredImage& out) {
    int passes = fillLists(method, request, request.layers);
    if (shadedComponents(shot_.settings.channels) > 0)
        passes += captureChannels(request.band, first_.back());
    const StageTimer timer(times_, "sort");
    const auto stored = readFragments();
    out.window = request.band;
    out.color.type =
        shot_.settings.hit_mode == HitMode::kSloped ? PixelType::kFloat : shot_.settings.color_type;
    out.color.channels = colorChannels(shot_.settings);
    const bool keyed = needsKeys(request);
    if (!keyed) out.extra.clear();
    std::vector<std::uint32_t> sources;
    const CapturedFragments captured = capturedIn(stored);
    depthSort(captured, shot_.view.projection, request.layers, out, keyed ? &sources : nullptr);
    if (keyed) addChannels(request, captured, sources, out);
    return passes;
}

int BandCapture::composite(LayerMethod& method, const BandRequest& request, CompositeImage& out) {
    const int passes = fillLists(method, request, blendsTail() ? 0 : request.layers);
    const StageTimer timer(times_, "composite");
    const auto stored = readFragments();
    out.window = request.band;
    depthSortComposite(capturedIn(stored), shot_.view.projection, request.layers,
                       shot_.settings.tail,
                       {colorChannels(shot_.settings), shot_.settings.color_type, {}}, out);
    return passes;
}

bool BandCapture::needsKeys(const BandRequest& request) const {
    return request.keys || shot_.settings.hit_mode != HitMode::kNone ||
           !shot_.settings.channels.empty();
}

gl::Buffer::Mapping BandCapture::readFragments() {
    return buffers_.fragments().read(first_.back() *
                                     BandBuffers::fragmentWords(shot_.settings.storedColorBytes()) *
                                     sizeof(std::uint32_t));
}

CapturedFragments BandCapture::capturedIn(const gl::Buffer::Mapping& stored) const {
    return {first_, stored.as<const std::uint32_t>(),
            BandBuffers::fragmentWords(shot_.settings.storedColorBytes())};
}

int BandCapture::fillLists(LayerMethod& method, const BandRequest& request, std::uint32_t layers) {
    const StageTimer timer(times_, "capture");
    const Window& band = request.band;
    const std::size_t pixels = band.pixels();
    const std::uint32_t limit = method.takesAll() || layers == 0 ? kNoLimit : layers;
    first_.resize(pixels + 1);
    first_[0] = 0;
    for (std::size_t p = 0; p < pixels; ++p)
        first_[p + 1] = first_[p] + std::min(request.counts[p], limit);
    const std::size_t fragments = first_[pixels];
    const bool target = method.takesSlotTarget() && SlotTarget::supported(context_);
    prepareClip(band);
    buffers_.reserveFragments(fragments *
                              BandBuffers::fragmentWords(shot_.settings.storedColorBytes()));
    if (!target) setSlots({first_.data(), pixels});
    buffers_.bindForLayers();
    rasterizer_.setBand(band);
    ends_.assign(first_.begin(), first_.end() - 1);
    int passes = 0;
    forEachTile(band, [&](const Window& tile, const Window& window) {
        LayerArea area{.window = window, .keys = needsKeys(request)};
        area.layers =
            largestIn(band, window, [&](std::size_t p) { return first_[p + 1] - first_[p]; });
        if (area.layers == 0) return;
        rasterizer_.setTile(tile);
        if (target) slot_target_.write(gl(), tile, window, band, first_);
        area.slot_target = target;
        area.in_front = request.in_front;
        area.framebuffer = target ? slot_target_.framebuffer() : 0;
        gl::Framebuffer with_depths;
        if (request.in_front) {
            with_depths = framebufferInFront();
            area.framebuffer = with_depths.name();
        }
        passes += method.capture(rasterizer_, area);
        if (target) slot_target_.read(gl(), tile, window, band, ends_);
    });
    gl::waitForGpu(gl());
    gl::checkErrors(gl(), "capturing fragments");
    if (!target) {
        const auto slots = buffers_.slots().read(pixels * sizeof(std::uint32_t));
        std::copy_n(slots.as<const std::uint32_t>(), pixels, ends_.begin());
    }
    checkSlots(ends_.data(), band, first_, std::span(first_).subspan(1));
    return passes;
}

void BandCapture::setSlots(std::span<const std::uint32_t> slots) {
    buffers_.reserveSlots(slots.size());
    const auto mapping = buffers_.slots().overwrite(slots.size_bytes());
    std::copy(slots.begin(), slots.end(), mapping.as<std::uint32_t>());
}

int BandCapture::captureChannels(const Window& band, std::size_t fragments) {
    const StageTimer timer(times_, "capture");
    const std::size_t components = shadedComponents(shot_.settings.channels);
    buffers_.clearForChannels(std::max<std::size_t>(fragments, 1) * components);
    setSlots(std::span(first_).subspan(1));
    buffers_.bindForLayers();
    int passes = 0;
    forEachTile(band, [&](const Window& tile, const Window& area) {
        rasterizer_.setTile(tile);
        const auto framebuffer = gl::makeEmptyFramebuffer(gl(), tile.width(), tile.height());
        rasterizer_.draw({.fragment_shader = "channels.frag",
                          .describes = true,
                          .bounded = false,
                          .framebuffer = framebuffer.name(),
                          .argument = {{static_cast<int>(components), 0, 0, 0}}},
                         area);
        passes = 1;
    });
    gl::waitForGpu(gl());
    gl::checkErrors(gl(), "capturing channels");
    return passes;
}

void BandCapture::addChannels(const BandRequest& request, const CapturedFragments& captured,
                              std::span<std::uint32_t> sources, LayeredImage& out) {
    const std::vector<Channel>& channels = shot_.settings.channels;
    const bool hits = shot_.settings.hit_mode != HitMode::kNone, keyed = hits || request.keys;
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
            keys[i] = captured.primitive(sources[i]);
    });

    FragmentSources from{gpu_scene_.posed(), shot_.view, next_frame_, keys, sources};
    const std::span<FragmentArray> arrays = std::span(out.extra).last(channels.size());
    const auto fill = [&] {
        if (shot_.settings.hit_mode != HitMode::kRefined)
            return fillChannels(from, channels, out, arrays);
        const double correction = refineHits(from, channels, out, keys, sources, arrays);
        largest_correction_ = std::max(largest_correction_, correction);
    };
    const std::size_t floats = shadedComponents(channels) * first_.back();
    if (floats == 0) return fill();
    const auto values = buffers_.channels().read(floats * sizeof(float));
    from.values = values.as<const float>();
    fill();
}

int BandCapture::composite(CompositeMethod& method, const BandRequest& request,
                           CompositeImage& out) {
    const StageTimer timer(times_, "capture");
    const Window& band = request.band;
    const std::uint32_t limit = limitOf(request);
    prepareClip(band);
    buffers_.clearForComposite(request.counts, shot_.settings.tinted);
    buffers_.bindForComposite();
    rasterizer_.setBand(band, limit);
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
            const auto slots = buffers_.slots().read(band.pixels() * sizeof(std::uint32_t));
            const auto* done = slots.as<const std::uint32_t>();
            return largestIn(band, window, [&](std::size_t p) {
                const std::uint32_t wanted = std::min(request.counts[p], limit);
                return done[p] == wanted ? 0 : wanted;
            });
        };
        rasterizer_.setTile(tile);
        passes += method.composite(rasterizer_, area);
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
                count = std::min(count, limitOf(request));
        }
        const auto slots = buffers_.slots().read(pixels * sizeof(std::uint32_t));
        checkSlots(slots.as<const std::uint32_t>(), request.band, {}, expected);
    }
    const auto depths = buffers_.depths().read(pixels * sizeof(float));
    const std::size_t records = shot_.settings.tinted ? 2 : 1;
    const auto colors = buffers_.colors().read(pixels * records * 4 * sizeof(float));
    const auto* depth = depths.as<const float>();
    const auto* color = colors.as<const std::array<float, 4>>();
    out.window = request.band;
    // No method touches an area without fragments: the buffers may hold an earlier band's there.
    out.rgba.assign(pixels, {});
    out.opacity.assign(shot_.settings.tinted ? pixels : 0, {});
    out.z.assign(pixels, std::numeric_limits<float>::infinity());
    for (std::size_t p = 0; p < pixels; ++p) {
        if (request.counts[p] == 0) continue;
        out.rgba[p] = color[records * p];
        if (out.tinted()) {
            const auto& [r, g, b, unused] = color[records * p + 1];
            out.opacity[p] = {r, g, b};
            out.rgba[p][3] = meanOpacity(r, g, b);
        }
        const double z = shot_.view.projection.linearZ(static_cast<double>(depth[p]));
        out.z[p] = static_cast<float>(z);
    }
}

}  // namespace peeler
