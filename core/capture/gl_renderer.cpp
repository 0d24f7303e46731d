// SPDX-License-Identifier: Apache-2.0
#include "core/capture/gl_renderer.h"

#include <algorithm>
#include <numeric>
#include <utility>

#include <peeler/error.h>
#include "core/base/stage_times.h"
#include "core/capture/gl_renderer_state.h"
#include "core/capture/supersampling.h"
#include "core/image/channels.h"
#include "core/image/composite.h"
#include "core/image/layers.h"

namespace peeler {
namespace {

std::uint64_t imageBytes(const LayeredImage& image) {
    return image.offsets.size() * sizeof(std::uint32_t) + image.z.size() * sizeof(float) +
           image.color.data.size() +
           std::accumulate(
               image.extra.begin(), image.extra.end(), std::size_t{0},
               [](std::size_t sum, const FragmentArray& array) { return sum + array.data.size(); });
}

}  // namespace

GlRenderer::GlRenderer(gl::Context& context, PosedScene posed)
    : state_(std::make_unique<State>(context, std::move(posed))) {}

GlRenderer::~GlRenderer() = default;

void GlRenderer::setPose(PosedScene posed) {
    State& s = *state_;
    const bool still = s.posed.deformed().empty() && s.posed.meshes() == posed.meshes();
    const bool lit_alike = still && s.posed.lights() == posed.lights();
    s.posed = std::move(posed);
    if (!still) timed(s.times, "upload", [&] { s.band_capture.setPose(s.posed); });
    // Shadow maps are worth keeping where only the camera moves.
    if (lit_alike) return;
    s.lighting.setShadows(nullptr);
    s.shadows.reset();
    s.lighting.setPose(s.posed);
}

void GlRenderer::setNextFrame(NextFrame next) {
    state_->next_frame = std::move(next);
    state_->band_capture.setNextFrame(&*state_->next_frame);
}

const PosedScene& GlRenderer::posed() const {
    return state_->posed;
}

StageTimes GlRenderer::takeTimes() {
    state_->band_capture.takeGpuTimes();
    return std::exchange(state_->times, {});
}

void checkSettings(const CaptureSettings& settings) {
    const MethodInfo* method = findPeelMethod(settings.method);
    const std::string where = "`method` " + settings.method;
    if (!method)
        throw Error(ErrorKind::kUsage, "there is no method '" + settings.method + "'", where);
    if (!method->exact() && !settings.composite) {
        throw Error(ErrorKind::kUsage,
                    settings.method + " finds no layers: it approximates their composite", where,
                    "add `composite` or write a .png, or choose another method");
    }
    if (!method->exact() && (settings.max_layers != 0 || settings.occlusion_ratio > 0)) {
        throw Error(ErrorKind::kUsage,
                    settings.method + " takes all layers at once and can keep no few", where,
                    "leave `max_layers` and `occlusion_ratio` out, or choose another method");
    }
    if (settings.tail == Tail::kBlend && !settings.composite) {
        throw Error(ErrorKind::kUsage, "layers are stored as they are found, never blended",
                    "`tail` blend", "add `composite` or write a .png, or leave `tail` out");
    }
    if (settings.hit_mode != HitMode::kNone &&
        (!method->layers()->takesAll() || settings.composite || settings.samples > 1 ||
         settings.max_layers != 0)) {
        throw Error(ErrorKind::kInternal, "all hits of rays are found at once, and as they are",
                    where);
    }
    if (settings.composite && !settings.channels.empty()) {
        throw Error(ErrorKind::kUsage, "a composite that is found on the fly has no channels",
                    "`channels`", "leave `channels` out, or capture layers");
    }
}

/// Hands the lights the shadow maps that the settings ask for, which are captured unless they are
/// there already.
void GlRenderer::State::castShadows(GlRenderer& renderer, const CaptureSettings& asked) {
    lighting.setShadows(nullptr);
    if (!asked.shadows || asked.shading == Shading::kUnlit) return;
    if (!shadows || shadows->size != asked.shadow_size || shadows->clip != asked.clip) {
        shadows.reset();  // free first: never hold both
        shadows = captureShadowMaps(renderer, context, lighting.lights(), asked);
    }
    lighting.setShadows(&*shadows);
}

void GlRenderer::State::chooseMethod() {
    checkSettings(pass_context.settings);
    method = findPeelMethod(pass_context.settings.method);
    layer_method = method->exact() ? method->layers() : nullptr;
    // With coloured opacity layers are composited on the CPU: blending knows one alpha.
    const bool on_the_fly = pass_context.settings.composite && method->composite &&
                            !(pass_context.settings.tinted && method->exact());
    composite_method = on_the_fly ? method->composite() : nullptr;
}

/// Moves the view to one of the sample positions for what is captured from now on.
void GlRenderer::State::showSample(std::size_t i) {
    pass_context.view = plan.view;
    pass_context.view.sample = positions[i];
    band_capture.begin();
}

/// Clip meshes have lists of their own in every band, which have to fit, too.
void GlRenderer::State::countClip() {
    clip_rows.clear();
    if (pass_context.settings.clip.nodes.empty()) return;
    const Window& crop = plan.view.crop;
    const auto width = static_cast<std::ptrdiff_t>(crop.width());
    clip_rows.resize(static_cast<std::size_t>(crop.height()));
    const BandLimits limits =
        bandLimits(pass_context.settings.memory, usedBytes(pass_context.settings.memory), costs());
    for (std::size_t i = 0; i < positions.size(); ++i) {
        showSample(i);
        for (const Window& band : cutBands(crop, limits, [](int) { return 0; })) {
            band_capture.countClip(band, counts);
            for (int y = band.y0; y < band.y1; ++y) {
                const auto first = counts.begin() + (y - band.y0) * width;
                std::uint64_t& most = clip_rows[static_cast<std::size_t>(y - crop.y0)];
                most = std::max(most, std::accumulate(first, first + width, std::uint64_t{0}));
            }
        }
    }
}

/// Reports progress in a stage of the planning that goes from one share of it to another.
void GlRenderer::State::reportPlanned(double from, double to, double share) const {
    if (progress) progress(plan_share * (from + (to - from) * share));
}

/// Carries out the count pass of every view.
void GlRenderer::State::countViews() {
    const Window& crop = plan.view.crop;
    const auto width = static_cast<std::size_t>(crop.width());
    samples.emplace(crop);
    kept_counts = {};
    kept_bands.clear();
    freeBands();
    countClip();
    if (positions.size() == 1 && fitsKept(crop.pixels() * sizeof(std::uint32_t)))
        kept_counts.resize(crop.pixels());

    BandCosts counting = costs();
    counting.pixel_bytes = 2 * sizeof(std::uint32_t);
    if (!clip_rows.empty()) counting.pixel_bytes += 3 * sizeof(std::uint32_t);
    const BandLimits limits =
        bandLimits(pass_context.settings.memory, usedBytes(pass_context.settings.memory), counting);
    const double counted = mergesLayers() ? kCountShare : 1;
    std::uint64_t rows = 0;
    const std::uint64_t all_rows = positions.size() * static_cast<std::uint64_t>(crop.height());
    for (std::size_t i = 0; i < positions.size(); ++i) {
        showSample(i);
        // No fragments are stored while counting.
        for (const Window& band :
             cutBands(crop, limits, [&](int y) { return clipFragments(counting, y); })) {
            band_capture.count(band, counts);
            const StageTimer timer(times, "count");
            const auto first = static_cast<std::size_t>(band.y0 - crop.y0) * width;
            for (int y = band.y0; y < band.y1; ++y) {
                const auto row = static_cast<std::size_t>(y - band.y0) * width;
                samples->addRow(crop.x0, y, {counts.data() + row, width});
            }
            if (!kept_counts.empty())
                std::copy(counts.begin(), counts.end(),
                          kept_counts.begin() + static_cast<std::ptrdiff_t>(first));
            rows += static_cast<std::uint64_t>(band.height());
            reportPlanned(0, counted, static_cast<double>(rows) / static_cast<double>(all_rows));
        }
    }
}

/// How many layers several views have together is known only when they are merged.
void GlRenderer::State::mergeViews() {
    merged.reset();
    kept_passes = report.passes = 0;
    if (!mergesLayers()) return;
    merged.emplace(plan.view.crop);
    std::uint64_t kept = 0;
    bool keeps = true;
    for (const Window& band : bands(nullptr)) {
        captureMerged(band, image);
        merged->addBand(image);
        kept_passes = std::max(kept_passes, report.passes);
        report.passes = 0;
        kept += imageBytes(image);
        keeps = keeps && fitsKept(kept);
        if (keeps) kept_bands.push_back(image);
        reportPlanned(kCountShare, 1,
                      static_cast<double>(band.y1 - plan.view.crop.y0) / plan.view.crop.height());
    }
    if (!keeps) kept_bands.clear();
}

/// max_layers and occlusion_ratio of the settings: the first layer that touches fewer pixels than
/// the ratio is the last one, as if a pass had found it out.
void GlRenderer::State::limitLayers() {
    limit = pass_context.settings.max_layers;
    if (!(pass_context.settings.occlusion_ratio > 0)) return;
    const auto layers = (merged ? *merged : *samples).layers();
    const std::uint64_t views_counted = merged ? 1 : positions.size();
    const double enough = pass_context.settings.occlusion_ratio *
                          static_cast<double>(plan.view.crop.pixels() * views_counted);
    const auto few = std::find_if(layers.begin(), layers.end(), [&](const LayerPlan& layer) {
        return static_cast<double>(layer.pixels) < enough;
    });
    if (few == layers.end()) return;
    const auto found = static_cast<std::uint32_t>(few - layers.begin()) + 1;
    limit = limit ? std::min(limit, found) : found;
}

void GlRenderer::State::fillPlan() {
    const DepthComplexity& complexity = merged ? *merged : *samples;
    plan.color_type = pass_context.settings.color_type;
    plan.tinted = pass_context.settings.tinted;
    plan.channel_bytes =
        channelBytes(pass_context.settings.channels, pass_context.settings.color_type);
    if (pass_context.settings.hit_mode != HitMode::kNone)
        plan.channel_bytes += sizeof(std::uint32_t);
    plan.channels.clear();
    for (const Channel channel : pass_context.settings.channels)
        plan.channels.push_back(emptyArray(channel, pass_context.settings.color_type));
    plan.samples = pass_context.settings.samples;
    plan.layers = complexity.layers(method->exact() ? limit : 0);
    plan.fragments_counted = complexity.counted();
    plan.fragments_stored = 0;
    for (const LayerPlan& layer : plan.layers)
        plan.fragments_stored += layer.pixels;
    if (pass_context.settings.composite && pass_context.settings.tail == Tail::kBlend)
        plan.fragments_blended = plan.fragments_counted - plan.fragments_stored;
}

Plan GlRenderer::plan(const View& view, const CaptureSettings& settings, const Progress& progress) {
    State& s = *state_;
    s.castShadows(*this, settings);  // plans and captures, too
    s.pass_context.settings = settings;
    s.plan = {};
    s.plan.view = view;
    s.lighting.setView(view.camera_to_world);
    s.chooseMethod();
    s.positions = samplePositions(settings.samples);
    for (glm::dvec2& position : s.positions)
        position += view.sample - 0.5;
    if (settings.samples == 1) s.positions = {view.sample};
    s.showSample(0);
    s.chooseSurfaces();
    s.progress = progress;
    s.plan_share = !progress ? 0 : s.mergesLayers() ? kMergeShare : kCountShare;
    if (!s.compositeViews()) {
        s.countViews();
        s.mergeViews();
    }
    s.limitLayers();
    s.fillPlan();
    s.progress = {};
    return s.plan;
}

/// The fragments of every pixel of a band of the current view.
std::span<const std::uint32_t> GlRenderer::State::countsOf(const Window& band) {
    if (kept_counts.empty()) {
        band_capture.count(band, counts);
        return counts;
    }
    const Window& crop = plan.view.crop;
    const auto first =
        static_cast<std::size_t>(band.y0 - crop.y0) * static_cast<std::size_t>(crop.width());
    return std::span(kept_counts).subspan(first, band.pixels());
}

void GlRenderer::State::captureLayers(const Window& band, std::uint32_t most, LayeredImage& out) {
    report.passes += band_capture.layers(
        *layer_method,
        {.band = band, .counts = countsOf(band), .layers = most, .keys = mergesLayers()}, out);
}

void GlRenderer::State::compositeView(const Window& band, CompositeImage& out) {
    const BandRequest request{.band = band, .counts = countsOf(band), .layers = limit};
    report.passes += composite_method ? band_capture.composite(*composite_method, request, out)
                                      : band_capture.composite(*layer_method, request, out);
}

void GlRenderer::State::captureMerged(const Window& band, LayeredImage& out) {
    std::vector<LayeredImage> images(positions.size());
    for (std::size_t i = 0; i < positions.size(); ++i) {
        showSample(i);
        captureLayers(band, 0, images[i]);
    }
    const StageTimer timer(times, "sort");
    mergeSamples(
        images, [&](std::uint32_t primitive) { return band_capture.surfaceOf(primitive); },
        pass_context.settings.color_type, out);
}

/// Makes what the sinks get of a band.
void GlRenderer::State::render(const Window& band, const TakeBand& take) {
    if (opaque_first) return composeVisible(band, take);
    if (!pass_context.settings.composite) {
        if (mergesLayers()) {
            captureMerged(band, image);
            keepLayers(image, {.nearest = limit});
        } else {
            captureLayers(band, limit, image);
        }
        return take(image);
    }
    if (positions.size() > 1) beginMean(band, composite, pass_context.settings.tinted);
    CompositeImage sample;
    for (std::size_t i = 0; i < positions.size(); ++i) {
        if (positions.size() > 1) showSample(i);
        compositeView(band, positions.size() > 1 ? sample : composite);
        if (positions.size() > 1) addToMean(sample, pass_context.settings.samples, composite);
    }
    {
        const StageTimer timer(times, "composite");
        toSingleLayer(composite, image);
    }
    take(image);
}

/// Whether a band is captured while the one before is taken: of layers that are handed over as they
/// are found.
bool GlRenderer::State::overlapsBands() const {
    return band_capture.overlaps() && !opaque_first && !pass_context.settings.composite &&
           !mergesLayers();
}

/// The same for all bands, where the GPU captures one while the CPU takes the one before.
void GlRenderer::State::renderOverlapping(std::span<const Window> bands, const TakeBand& take) {
    for (std::size_t i = 0; i <= bands.size(); ++i) {
        if (i < bands.size()) {
            const Window& band = bands[i];
            band_capture.submit(*layer_method,
                                {.band = band, .counts = countsOf(band), .layers = limit},
                                lists[i % 2]);
        }
        if (i == 0) continue;
        report.passes += band_capture.take(lists[(i - 1) % 2], image);
        take(image);
    }
}

std::uint64_t GlRenderer::forecastMemory(const Sink& sink) {
    return state_->forecast(sink);
}

CaptureReport GlRenderer::capture(Sink& sink, const Progress& progress) {
    State& s = *state_;
    s.report = {};
    s.visible = 0;
    std::uint64_t stored = 0;
    int passes = 0;
    const Window& crop = s.plan.view.crop;
    const auto take = [&](LayeredImage& image) {
        stored += image.fragments();
        const double share = static_cast<double>(image.window.y1 - crop.y0) / crop.height();
        sink.write(std::move(image));
        if (progress) progress(s.plan_share + (1 - s.plan_share) * share);
        passes = std::max(passes, s.report.passes);
        s.report.passes = 0;
        ++s.report.bands;
    };
    if (!s.kept_bands.empty()) {
        passes = s.kept_passes;
        s.freeBands();
        for (LayeredImage& image : s.kept_bands) {
            keepLayers(image, {.nearest = s.limit});
            take(image);
        }
    } else {
        const std::vector<Window> bands = s.bands(&sink);
        if (s.overlapsBands()) {
            s.renderOverlapping(bands, take);
        } else {
            for (const Window& band : bands)
                s.render(band, take);
        }
    }
    s.report.passes = passes;
    s.report.largest_correction = s.band_capture.largestCorrection();
    if (!s.pass_context.settings.composite && stored != s.plan.fragments_stored) {
        throw Error(ErrorKind::kInternal, std::to_string(stored) + " fragments were captured and " +
                                              std::to_string(s.plan.fragments_stored) + " planned");
    }
    if (s.opaque_first && s.kept_bands.empty() && s.visible != s.plan.fragments_stored) {
        throw Error(ErrorKind::kInternal, std::to_string(s.visible) + " fragments were seen and " +
                                              std::to_string(s.plan.fragments_stored) + " planned");
    }
    return s.report;
}

}  // namespace peeler
