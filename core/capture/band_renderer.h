// SPDX-License-Identifier: Apache-2.0
// Rendering of a GlPlan's bands for sinks.
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

/// A callback that passes a band, or some of its rows, to the sinks.
using TakeBand = std::function<void(LayeredImage&)>;

/// A renderer of bands. Owns the uploaded scene, its lights, and the bands' buffers. Adds to the
/// times of the stages "count", "capture", "sort", "composite" and "upload".
class BandRenderer {
  public:
    /// `context` is null for scenes of splats alone. All arguments must outlive this object.
    BandRenderer(gl::Context* context, const PosedScene& posed, StageTimes& times);

    BandCapture& capture() { return capture_; }
    /// Returns the lighting; null without a context.
    Lighting* lighting() { return lighting_ ? &*lighting_ : nullptr; }

    /// Selects the plan whose bands will be rendered. The plan must have its view, settings, method
    /// and positions set, and must exist as long as it is selected.
    void begin(const GlPlan& plan);
    /// Moves the view to sample position `i` for all later captures.
    void showSample(std::size_t i);
    /// Applies a change of `surfaces` in the plan's settings.
    void takeSurfaces() {
        pass_context_.shown = plan_->settings.surfaces;
        pass_context_.settings.surfaces =
            capture_.hasSplats() ? Surfaces::kAll : plan_->settings.surfaces;
    }

    /// Returns the plan's methods. If the plan is for a composite and has no CompositeMethod,
    /// captured layers are composited on the CPU.
    const PlanMethods& methods() const { return methods_; }
    /// Whether the GPU captures a band while the CPU sorts the previous band and passes it on. True
    /// only for layers that are neither merged nor composited.
    bool overlapsBands() const;
    BandBudget budget() const;
    /// Frees the buffers of earlier bands, even of other plans. Otherwise a budget would count
    /// these buffers twice: as resident memory, and as memory that the next bands need. Keeps the
    /// buffers for reuse if the budget has room for both.
    void freeBands();

    /// Renders a band. Throws Error (kInternal) if the number of captured fragments of a pixel
    /// differs from its count.
    void render(const Window& band, const BandLimits& limits, const TakeBand& take,
                const TakeCounts& visible);
    /// Renders a band of a plan for layers, without channels or merged samples, into the GPU's
    /// buffers (BandCapture::layersOnGpu()).
    GlLayers renderOnGpu(const Window& band);
    /// Renders all bands. The GPU captures a band while the CPU sorts and passes on the previous
    /// band.
    void renderOverlapping(std::span<const Window> bands, const TakeBand& take);
    /// Renders a band of a plan with `opaque_first`, without fragments behind opaque surfaces.
    void renderVisible(const Window& band, const BandLimits& limits, const TakeBand& take,
                       const TakeCounts& visible);
    /// Counts what renderVisible() finds in a band of a plan with `shades_pixels`, without shading.
    void countVisible(const Window& band, const TakeCounts& visible);
    /// Captures all samples of a band and merges them.
    void renderMerged(const Window& band, LayeredImage& out);

    /// Returns the number of geometry passes since the previous call.
    int takePasses() { return std::exchange(passes_, 0); }

  private:
    std::span<const std::uint32_t> countsOf(const Window& band);
    void captureLayers(const Window& band, std::uint32_t most, LayeredImage& out);
    void compositeView(const Window& band, CompositeImage& out);

    StageTimes& times_;
    PassContext pass_context_;
    BandCapture capture_;
    std::optional<Lighting> lighting_;
    const GlPlan* plan_ = nullptr;
    std::size_t sample_ = 0;  ///< index of the view's sample position
    PlanMethods methods_;
    std::vector<std::uint32_t> counts_;  ///< number of fragments in each pixel of the current band
    std::array<BandLists, 2> lists_;     ///< lists of overlapping bands
    LayeredImage image_;
    CompositeImage composite_;
    int passes_ = 0;
};

}  // namespace peeler
