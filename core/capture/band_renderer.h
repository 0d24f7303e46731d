// SPDX-License-Identifier: Apache-2.0
// Renders the bands of a GlPlan as sinks get them.
#pragma once

#include <array>
#include <cstdint>
#include <functional>
#include <optional>
#include <span>
#include <vector>

#include <peeler/composite.h>
#include <peeler/stage_times.h>
#include "core/capture/band_budget.h"
#include "core/capture/band_capture.h"
#include "core/capture/gl_plan.h"
#include "core/capture/pass_context.h"
#include "core/fragments/bands.h"
#include "core/gl/context.h"
#include "core/scene/posed_scene.h"
#include "core/shading/lighting.h"

namespace peeler {

/// Takes what the sinks get of a band, or of some rows of it.
using TakeBand = std::function<void(LayeredImage&)>;
/// Takes how many fragments are visible in the pixels of some rows.
using TakeCounts = std::function<void(const Window& rows, std::span<const std::uint32_t> counts)>;

/// Owns the uploaded scene, its lights, and what one band after the other is rendered into.
/// "count", "capture", "sort", "composite" and "upload" are added to the times.
class BandRenderer {
  public:
    /// The posed scene and the times must outlive it.
    BandRenderer(gl::Context& context, const PosedScene& posed, StageTimes& times);

    BandCapture& capture() { return capture_; }
    Lighting& lighting() { return lighting_; }

    /// Renders the bands of this plan from now on, whose view, settings, method and positions are
    /// known; it must stay.
    void begin(const GlPlan& plan);
    /// Moves the view to one of the sample positions for what is captured from now on.
    void showSample(std::size_t i);
    /// Takes the surfaces of the plan's settings as they are now.
    void takeSurfaces() { pass_context_.settings.surfaces = plan_->settings.surfaces; }

    /// The plan's methods; captured layers may be composited on the CPU.
    const PlanMethods& methods() const { return methods_; }
    /// Whether a band is captured while the one before is taken: of layers that are handed over as
    /// they are found.
    bool overlapsBands() const;
    /// What the plan's bands cost.
    BandBudget budget() const;
    /// What earlier bands have left, of this plan or another, is not to be counted twice under a
    /// budget: as resident memory and as what the next bands take. Where there is room for both,
    /// the buffers serve again.
    void freeBands();

    /// Renders a band. Throws Error (kInternal) if the hits of a pixel differ from the count.
    void render(const Window& band, const BandLimits& limits, const TakeBand& take,
                const TakeCounts& visible);
    /// The same for all bands, where the GPU captures one while the CPU takes the one before.
    void renderOverlapping(std::span<const Window> bands, const TakeBand& take);
    /// Renders a band of a plan with `opaque_first`: without what lies behind opaque surfaces.
    void renderVisible(const Window& band, const BandLimits& limits, const TakeBand& take,
                       const TakeCounts& visible);
    /// Captures all samples of a band and merges them.
    void renderMerged(const Window& band, LayeredImage& out);

    /// The geometry passes since the last call.
    int takePasses() { return std::exchange(passes_, 0); }

  private:
    std::span<const std::uint32_t> countsOf(const Window& band);
    void captureLayers(const Window& band, std::uint32_t most, LayeredImage& out);
    void compositeView(const Window& band, CompositeImage& out);

    gl::Context& context_;
    StageTimes& times_;
    PassContext pass_context_;
    BandCapture capture_;
    Lighting lighting_;
    const GlPlan* plan_ = nullptr;
    PlanMethods methods_;
    std::vector<std::uint32_t> counts_;  ///< of the band being captured
    std::array<BandLists, 2> lists_;     ///< of bands that overlap
    LayeredImage image_;
    CompositeImage composite_;
    int passes_ = 0;
};

}  // namespace peeler
