// SPDX-License-Identifier: Apache-2.0
// What a GlRenderer has at hand while it plans and captures; for its own files.
#pragma once

#include <array>
#include <cstdint>
#include <functional>
#include <memory>
#include <optional>
#include <span>
#include <utility>
#include <vector>

#include <peeler/composite.h>
#include "core/base/stage_times.h"
#include "core/capture/band_capture.h"
#include "core/capture/bands.h"
#include "core/capture/gl_renderer.h"
#include "core/capture/method.h"
#include "core/image/layers.h"
#include "core/shading/lighting.h"

namespace peeler {

// What the planning has found is kept for the capture if it is no more than this share of the
// budget (or this many bytes without one); otherwise it is found again.
inline constexpr std::uint64_t kKeptShare = 6;
inline constexpr std::uint64_t kKeptBytes = 256ULL << 20;

// Of a composite, which is handed over in parts whose memory is soon used again.
inline constexpr int kRowsHandedOver = 128;

// How much of a picture's time planning takes, roughly: one cheap pass of two or three and the
// writing, or with several samples the whole capture once.
inline constexpr double kCountShare = 0.2, kMergeShare = 0.6, kCompositeShare = 0.8;

/// Captures what directional and spot lights see through `renderer`, whose last plan is forgotten.
/// `settings` say how large the maps are and how much memory there is. Throws Error (kUsage) if the
/// device takes no textures of this size, (kInput) if it takes no array of so many, (kMemory) if
/// they alone pass the budget, and what GlRenderer throws.
ShadowMaps captureShadowMaps(GlRenderer& renderer, const gl::Context& context,
                             const std::vector<PlacedLight>& lights,
                             const CaptureSettings& settings);

/// Takes what the sinks get of a band, or of some rows of it.
using TakeBand = std::function<void(LayeredImage&)>;

struct GlRenderer::State {
    State(gl::Context& ctx, PosedScene shown)
        : context(ctx),
          posed(std::move(shown)),
          band_capture(ctx, posed, pass_context, times),
          lighting(timedLighting(ctx, posed, times)) {
        pass_context.lighting = &lighting;
    }

    /// Prefiltering an environment of a file takes its time.
    static Lighting timedLighting(gl::Context& ctx, const PosedScene& posed, StageTimes& times) {
        const StageTimer timer(times, "upload");
        return {ctx.functions(), posed};
    }

    gl::Context& context;
    PosedScene posed;
    std::optional<NextFrame> next_frame;
    StageTimes times;
    PassContext pass_context;  // of the last plan
    BandCapture band_capture;
    Lighting lighting;
    std::optional<ShadowMaps> shadows;  // of the pose, once something was lit that has them

    const MethodInfo* method = nullptr;
    std::unique_ptr<LayerMethod> layer_method;
    std::unique_ptr<CompositeMethod> composite_method;  // used if there is one
    Plan plan;
    std::uint32_t limit = 0;                 // nearest layers to keep; 0 = all
    std::vector<glm::dvec2> positions;       // in a pixel, of the samples: a view each
    std::optional<DepthComplexity> samples;  // of all views together
    std::optional<DepthComplexity> merged;   // of the layers they merge into
    std::vector<std::uint64_t> clip_rows;    // surfaces of clip meshes a row, of the worst view
    std::vector<std::uint32_t> kept_counts;  // of the whole crop, or empty; one view only
    std::vector<LayeredImage> kept_bands;    // likewise, what is handed over of them
    std::vector<std::uint32_t> counts;       // of the band being captured
    std::array<BandLists, 2> lists;          // of bands that overlap
    LayeredImage image;
    CompositeImage composite;
    CaptureReport report;
    Progress progress;          // of the plan in the making
    double plan_share = 0;      // of a picture's work, as progress counts it
    int kept_passes = 0;        // that the kept bands took
    bool opaque_first = false;  // whether composites are captured by compositeVisible()
    Window drawn;               // then: outside of it there is nothing
    BandLimits band_limits{};   // of the bands that are being captured
    BandCosts band_costs{};     // of the same
    bool planning = false;      // whether what compositeVisible() finds is still to be counted
    std::uint64_t visible = 0;  // fragments that it found

    bool mergesLayers() const { return positions.size() > 1 && !pass_context.settings.composite; }
    bool fitsKept(std::uint64_t bytes) const {
        return bytes <= (pass_context.settings.memory != 0
                             ? pass_context.settings.memory / kKeptShare
                             : kKeptBytes);
    }
    void freeBands();
    BandCosts costs() const;
    std::uint64_t clipFragments(const BandCosts& costs, int y) const;
    std::uint64_t rowFragments(int y) const;
    void addSink(const Sink& sink, BandCosts& costs) const;
    std::vector<Window> bands(const Sink* sink);
    std::uint64_t forecast(const Sink& sink);

    void castShadows(GlRenderer& renderer, const CaptureSettings& asked);
    void chooseMethod();
    void chooseSurfaces();
    bool compositeViews();
    void showSample(std::size_t i);
    void countClip();
    void countViews();
    void mergeViews();
    void limitLayers();
    void fillPlan();
    void reportPlanned(double from, double to, double share) const;

    std::span<const std::uint32_t> countsOf(const Window& band);
    void captureLayers(const Window& band, std::uint32_t most, LayeredImage& out);
    void compositeView(const Window& band, CompositeImage& out);
    void addVisible(const Window& rows, std::span<const std::uint32_t> visible_counts);
    void composeVisible(const Window& band, const TakeBand& take);
    void render(const Window& band, const TakeBand& take);
    bool overlapsBands() const;
    void renderOverlapping(std::span<const Window> bands, const TakeBand& take);
    void captureMerged(const Window& band, LayeredImage& out);
};

}  // namespace peeler
