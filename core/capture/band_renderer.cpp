// SPDX-License-Identifier: Apache-2.0
#include "core/capture/band_renderer.h"

#include <algorithm>
#include <utility>

#include "core/base/process_memory.h"
#include "core/base/stage_times.h"
#include "core/fragments/supersampling.h"
#include "core/image/composite.h"
#include "core/image/layers.h"

namespace peeler {
namespace {

// The number of rows of a composite that are passed on at once. A small number lets the rows'
// memory be reused soon.
constexpr int kRowsHandedOver = 128;

/// Creates the lighting of the scene. Counts the time in the stage "upload", because prefiltering
/// an environment map is slow.
Lighting timedLighting(gl::Context& context, const PosedScene& posed, StageTimes& times) {
    const StageTimer timer(times, "upload");
    return {context.functions(), posed};
}

PlanMethods methodsOf(const GlPlan& plan) {
    PlanMethods methods;
    if (plan.method->exact()) methods.layers = plan.method->layers();
    // Layers with coloured opacity are composited on the CPU, because GL blending has only one
    // alpha.
    // So are layers that the CPU finds.
    const bool on_the_fly = plan.settings.composite && plan.method->composite && !plan.on_cpu &&
                            !(plan.settings.tinted && plan.method->exact());
    if (on_the_fly) methods.composite = plan.method->composite();
    return methods;
}

}  // namespace

BandRenderer::BandRenderer(gl::Context* context, const PosedScene& posed, StageTimes& times)
    : times_(times), capture_(context, posed, pass_context_, times) {
    if (context) lighting_.emplace(timedLighting(*context, posed, times));
    pass_context_.lighting = lighting();
}

void BandRenderer::begin(const GlPlan& plan) {
    plan_ = &plan;
    pass_context_.settings = plan.settings;
    takeSurfaces();
    if (lighting_) lighting_->setView(plan.view.camera_to_world);
    methods_ = methodsOf(plan);
    showSample(0);
}

void BandRenderer::showSample(std::size_t i) {
    sample_ = i;
    pass_context_.view = plan_->view;
    if (!plan_->shades_pixels) pass_context_.view.sample = plan_->positions[i];
    capture_.begin();
}

bool BandRenderer::overlapsBands() const {
    return capture_.overlaps() && !plan_->on_cpu && !plan_->opaque_first &&
           !plan_->settings.composite && !plan_->mergesLayers();
}

BandBudget BandRenderer::budget() const {
    return {*plan_, methods_, capture_, overlapsBands()};
}

void BandRenderer::freeBands() {
    const MemoryBudget& memory = plan_->settings.memory;
    if (isRoomy(memory, usedBytes(memory), budget().costs())) return;
    capture_.free();
    lists_ = {};
    image_ = {};
    composite_ = {};
    methods_ = methodsOf(*plan_);
    returnFreeMemory();
}

/// Returns the fragment counts of a band of the current view.
std::span<const std::uint32_t> BandRenderer::countsOf(const Window& band) {
    if (plan_->kept_counts.empty()) {
        capture_.count(band, counts_);
        return counts_;
    }
    const Window& crop = plan_->view.crop;
    const auto above =
        static_cast<std::size_t>(band.y0 - crop.y0) * static_cast<std::size_t>(crop.width());
    return std::span(plan_->kept_counts).subspan(sample_ * crop.pixels() + above, band.pixels());
}

void BandRenderer::captureLayers(const Window& band, std::uint32_t most, LayeredImage& out) {
    passes_ +=
        capture_.layers(*methods_.layers,
                        {.band = band,
                         .counts = countsOf(band),
                         .layers = most,
                         .keys = plan_->mergesLayers() ? StoredKeys::kSurface : StoredKeys::kOrder},
                        out);
}

void BandRenderer::compositeView(const Window& band, CompositeImage& out) {
    const BandRequest request{.band = band, .counts = countsOf(band), .layers = plan_->limit};
    passes_ += methods_.composite ? capture_.composite(*methods_.composite, request, out)
                                  : capture_.composite(*methods_.layers, request, out);
}

void BandRenderer::renderMerged(const Window& band, LayeredImage& out) {
    std::vector<LayeredImage> images(plan_->positions.size());
    for (std::size_t i = 0; i < images.size(); ++i) {
        showSample(i);
        captureLayers(band, 0, images[i]);
    }
    const StageTimer timer(times_, "sort");
    mergeSamples(
        images, [&](std::uint32_t key) { return capture_.surfaceOf(key); },
        plan_->settings.color_type, out);
}

void BandRenderer::render(const Window& band, const BandLimits& limits, const TakeBand& take,
                          const TakeCounts& visible) {
    if (plan_->opaque_first) return renderVisible(band, limits, take, visible);
    if (!plan_->settings.composite) {
        if (plan_->mergesLayers()) {
            renderMerged(band, image_);
            keepLayers(image_, {.nearest = plan_->limit});
        } else {
            captureLayers(band, plan_->limit, image_);
        }
        return take(image_);
    }
    const std::size_t samples = plan_->positions.size();
    if (samples > 1) beginMean(band, composite_, plan_->settings.tinted);
    CompositeImage sample;
    for (std::size_t i = 0; i < samples; ++i) {
        if (samples > 1) showSample(i);
        CompositeImage& view = samples > 1 ? sample : composite_;
        compositeView(band, view);
        if (plan_->settings.splat_blending == SplatBlending::kDisplay) decodeColors(view);
        if (samples > 1) addToMean(sample, plan_->settings.samples, composite_);
    }
    {
        const StageTimer timer(times_, "composite");
        toSingleLayer(composite_, image_);
    }
    take(image_);
}

GlLayers BandRenderer::renderOnGpu(const Window& band) {
    return capture_.layersOnGpu(*methods_.layers,
                                {.band = band, .counts = countsOf(band), .layers = plan_->limit});
}

void BandRenderer::renderOverlapping(std::span<const Window> bands, const TakeBand& take) {
    for (std::size_t i = 0; i <= bands.size(); ++i) {
        if (i < bands.size()) {
            const Window& band = bands[i];
            capture_.submit(*methods_.layers,
                            {.band = band, .counts = countsOf(band), .layers = plan_->limit},
                            lists_[i % 2]);
        }
        if (i == 0) continue;
        passes_ += capture_.take(lists_[(i - 1) % 2], image_);
        take(image_);
    }
}

void BandRenderer::countVisible(const Window& band, const TakeCounts& visible) {
    const Window seen = intersect(band, plan_->drawn);
    if (!seen.empty()) capture_.countVisibleSamples(seen, visible);
}

/// Renders only the window that can contain fragments, since pictures often have empty margins.
void BandRenderer::renderVisible(const Window& band, const BandLimits& limits, const TakeBand& take,
                                 const TakeCounts& visible) {
    const bool tinted = plan_->settings.tinted;
    const auto handOver = [&](const CompositeImage& rows) {
        {
            const StageTimer timer(times_, "composite");
            toSingleLayer(rows, {band.x0, rows.window.y0, band.x1, rows.window.y1}, image_);
        }
        take(image_);
    };
    const auto handOverEmpty = [&](int y0, int y1) {
        for (int y = y0; y < y1; y += kRowsHandedOver) {
            image_ = {};
            image_.window = {band.x0, y, band.x1, std::min(y + kRowsHandedOver, y1)};
            image_.offsets.resize(image_.window.pixels() + 1);
            image_.color = {colorNames(tinted), PixelType::kFloat, {}};
            take(image_);
        }
    };
    const Window seen = intersect(band, plan_->drawn);
    if (seen.empty()) return handOverEmpty(band.y0, band.y1);
    handOverEmpty(band.y0, seen.y0);
    // With several samples or several raster tiles side by side, rows are complete only at the end
    // of the band. Otherwise, rows can be passed on earlier.
    const std::size_t samples = plan_->positions.size();
    const bool whole = (samples > 1 && !plan_->shades_pixels) || capture_.tilesAcross(seen) > 1;
    if (whole) beginMean(seen, composite_, tinted);
    if (plan_->shades_pixels) {
        passes_ += capture_.compositeSamples(
            seen, limits, [&](const CompositeImage& rows, std::span<const std::uint32_t> counts) {
                for (; !counts.empty(); counts = counts.subspan(rows.window.pixels()))
                    visible(rows.window, counts.first(rows.window.pixels()));
                if (!whole) return handOver(rows);
                const StageTimer timer(times_, "composite");
                addToMean(rows, 1, composite_);
            });
    }
    for (std::size_t i = 0; i < samples && !plan_->shades_pixels; ++i) {
        if (samples > 1) showSample(i);
        passes_ += capture_.compositeVisible(
            *methods_.layers, seen, limits,
            [&](const CompositeImage& rows, std::span<const std::uint32_t> counts) {
                visible(rows.window, counts);
                if (!whole) return handOver(rows);
                const StageTimer timer(times_, "composite");
                addToMean(rows, static_cast<int>(samples), composite_);
            });
    }
    CompositeImage part;
    for (int y = seen.y0; whole && y < seen.y1; y += kRowsHandedOver) {
        part.setRows(composite_, y, std::min(y + kRowsHandedOver, seen.y1));
        handOver(part);
    }
    handOverEmpty(seen.y1, band.y1);
}

}  // namespace peeler
