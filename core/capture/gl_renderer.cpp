// SPDX-License-Identifier: Apache-2.0
#include "core/capture/gl_renderer.h"

#include <algorithm>
#include <numeric>
#include <utility>

#include <peeler/error.h>
#include "core/base/process_memory.h"
#include "core/base/stage_times.h"
#include "core/capture/band_renderer.h"
#include "core/capture/gl_plan.h"
#include "core/capture/gl_planner.h"
#include "core/capture/shadow_capture.h"
#include "core/image/layers.h"
#include "core/splats/projected_splats.h"

namespace peeler {
namespace {

// Bytes that forecasts must add to BandCosts. With llvmpipe (Mesa 22.3, LLVM 15, one or two
// threads), the captures of tests/memory_test.py take up to 35 MB more than BandCosts. LLVM
// compiles each pass's shaders on first draw, which takes 6 MB for plain materials, 27 MB for the
// materials of a car's engine, and more for peeling, which has two passes. The rasteriser's threads
// also keep triangles in bins. If kept bands are only passed on, no shaders are compiled, and up to
// 20 MB are taken.
constexpr std::uint64_t kCaptureBytes = std::uint64_t{40} << 20;
constexpr std::uint64_t kHandOverBytes = std::uint64_t{24} << 20;

}  // namespace

struct GlRenderer::State {
    State(gl::Context* ctx, PosedScene in_pose)
        : context(ctx), posed(std::move(in_pose)), bands(ctx, posed, times) {}

    void castShadows(GlRenderer& renderer, const CaptureSettings& asked);
    static void report(const GlPlan& plan, const Window& band, const Progress& progress);
    GlPlan& show(GlRenderer& renderer, const CapturePlan& planned);

    gl::Context* context;  ///< null: only splats are shown
    PosedScene posed;
    std::optional<NextFrame> next_frame;
    StageTimes times;
    BandRenderer bands;
    std::optional<ShadowMaps> shadows;  // shadow maps for `posed`, once a render needs them
    std::shared_ptr<GlPlan> shown;      // the plan that `bands` renders
    std::weak_ptr<GlPlan> latest;       // the only plan that keeps planning results
};

GlRenderer::GlRenderer(gl::Context& context, PosedScene posed)
    : state_(std::make_unique<State>(&context, std::move(posed))) {}

GlRenderer::GlRenderer(PosedScene posed)
    : state_(std::make_unique<State>(nullptr, std::move(posed))) {}

bool GlRenderer::canShow(const PosedScene& posed) const {
    return state_->context || hasOnlySplats(posed);
}

GlRenderer::~GlRenderer() = default;

void GlRenderer::setPose(PosedScene posed) {
    State& s = *state_;
    if (!canShow(posed)) throw Error(ErrorKind::kInternal, "surfaces need a context");
    const bool still = s.posed.deformed().empty() && s.posed.meshes() == posed.meshes();
    const bool lit_alike = still && s.posed.lights() == posed.lights();
    s.posed = std::move(posed);
    if (!still) timed(s.times, "upload", [&] { s.bands.capture().setPose(s.posed); });
    // Keeps the shadow maps if only the camera moved.
    if (lit_alike || !s.context) return;
    s.bands.lighting()->setShadows(nullptr);
    s.shadows.reset();
    s.bands.lighting()->setPose(s.posed);
}

void GlRenderer::setNextFrame(NextFrame next) {
    state_->next_frame = std::move(next);
    state_->bands.capture().setNextFrame(&*state_->next_frame);
}

const PosedScene& GlRenderer::posed() const {
    return state_->posed;
}

StageTimes GlRenderer::takeTimes() {
    state_->bands.capture().takeGpuTimes();
    return std::exchange(state_->times, {});
}

/// Sets the shadow maps that the settings require. Captures them if necessary.
void GlRenderer::State::castShadows(GlRenderer& renderer, const CaptureSettings& asked) {
    if (!context) return;
    Lighting& lighting = *bands.lighting();
    lighting.setShadows(nullptr);
    if (!asked.shadows || asked.shading == Shading::kUnlit) return;
    if (!shadows || shadows->size != asked.shadow_size || shadows->clip != asked.clip) {
        shadows.reset();  // free the old maps first, so that two sets are never held
        shadows = captureShadowMaps(renderer, *context, lighting.lights(), asked);
    }
    lighting.setShadows(&*shadows);
}

/// Reports that the picture is complete down to the end of this band.
void GlRenderer::State::report(const GlPlan& plan, const Window& band, const Progress& progress) {
    const Window& crop = plan.view.crop;
    const double share = static_cast<double>(band.y1 - crop.y0) / crop.height();
    if (progress) progress(plan.share + (1 - plan.share) * share);
}

/// Makes `bands` render this plan.
GlPlan& GlRenderer::State::show(GlRenderer& renderer, const CapturePlan& planned) {
    auto details = std::dynamic_pointer_cast<GlPlan>(planned.details);
    if (!details) throw Error(ErrorKind::kInternal, "the plan belongs to another source");
    if (details != shown) {
        castShadows(renderer, details->settings);
        bands.begin(*details);
        shown = std::move(details);
    }
    return *shown;
}

CapturePlan GlRenderer::plan(const View& view, const CaptureSettings& settings,
                             const Progress& progress) {
    State& s = *state_;
    s.castShadows(*this, settings);  // first, because it may itself plan and capture shadow maps
    checkSettings(settings);
    if (view.rays) checkRays(view, settings);
    if (s.bands.capture().hasSplats()) checkSplats(view, settings);
    checkSplatBlending(s.posed, settings);
    if (const auto before = s.latest.lock()) before->freeKept();
    s.shown = std::make_shared<GlPlan>();
    s.latest = s.shown;
    s.shown->view = view;
    s.shown->settings = settings;
    GlPlanner planner(s.bands, s.posed.drawList(), s.times, *s.shown, progress);
    planner.count();
    return {planner.plan(), s.shown, s.bands.capture().pixelsWithoutRay()};
}

std::uint64_t GlRenderer::forecastMemory(const CapturePlan& planned, const Sink& sink) {
    State& s = *state_;
    GlPlan& plan = s.show(*this, planned);
    s.bands.freeBands();
    const MemoryUse of_sink = sinkUse(plan, planned, sink);
    // Kept bands are already resident.
    if (!plan.kept_bands.empty()) return residentBytes() + of_sink.fixed + kHandOverBytes;
    BandBudget budget = s.bands.budget();
    budget.costs().use += of_sink;
    const std::uint64_t largest = budget.largest(budget.cut(budget.limits()));
    return residentBytes() + budget.costs().use.fixed + largest + kCaptureBytes;
}

std::vector<Window> GlRenderer::bandsOnGpu(const CapturePlan& planned) {
    State& s = *state_;
    s.show(*this, planned);
    s.bands.freeBands();
    const BandBudget budget = s.bands.budget();
    return budget.cut(budget.limits());
}

GlLayers GlRenderer::captureOnGpu(const CapturePlan& planned, const Window& band,
                                  const Progress& progress) {
    const GlPlan& plan = state_->show(*this, planned);
    if (plan.on_cpu)
        throw Error(ErrorKind::kUsage, "layers of lenses and splats do not stay on the GPU",
                    plan.view.camera_name, "capture them into memory");
    const GlLayers layers = state_->bands.renderOnGpu(band);
    State::report(plan, band, progress);
    return layers;
}

CaptureReport GlRenderer::capture(const CapturePlan& planned, Sink& sink,
                                  const Progress& progress) {
    State& s = *state_;
    GlPlan& plan = s.show(*this, planned);
    CaptureReport report;
    std::uint64_t stored = 0, visible = 0;
    const auto take = [&](LayeredImage& image) {
        stored += image.fragments();
        const Window band = image.window;
        sink.write(std::move(image));
        State::report(plan, band, progress);
        report.passes = std::max(report.passes, s.bands.takePasses());
        ++report.bands;
    };
    const auto count_visible = [&](const Window&, std::span<const std::uint32_t> counts) {
        visible += std::accumulate(counts.begin(), counts.end(), std::uint64_t{0});
    };
    s.bands.takePasses();
    s.bands.freeBands();
    const bool kept = !plan.kept_bands.empty();
    if (kept) {
        report.passes = plan.kept_passes;
        for (LayeredImage& image : plan.kept_bands) {
            keepLayers(image, {.nearest = plan.limit});
            take(image);
        }
        plan.kept_bands.clear();  // their contents have been moved out
    } else {
        BandBudget budget = s.bands.budget();
        budget.costs().use += sinkUse(plan, planned, sink);
        const BandLimits limits = budget.limits();
        const std::vector<Window> bands = budget.cut(limits);
        if (s.bands.overlapsBands()) {
            s.bands.renderOverlapping(bands, take);
        } else {
            for (const Window& band : bands)
                s.bands.render(band, limits, take, count_visible);
        }
    }
    report.largest_correction = s.bands.capture().largestCorrection();
    if (!plan.settings.composite && stored != planned.fragments_stored) {
        throw Error(ErrorKind::kInternal, std::to_string(stored) + " fragments were captured and " +
                                              std::to_string(planned.fragments_stored) +
                                              " planned");
    }
    if (plan.opaque_first && !kept && visible != planned.fragments_stored) {
        throw Error(ErrorKind::kInternal, std::to_string(visible) + " fragments were seen and " +
                                              std::to_string(planned.fragments_stored) +
                                              " planned");
    }
    return report;
}

}  // namespace peeler
