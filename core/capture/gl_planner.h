// SPDX-License-Identifier: Apache-2.0
// Planning: the count pass of a view, and the resulting GlPlan.
#pragma once

#include <peeler/sink.h>
#include <peeler/work.h>
#include "core/capture/band_renderer.h"
#include "core/capture/gl_plan.h"
#include "core/gl/context.h"
#include "core/scene/draw_list.h"

namespace peeler {

/// Throws Error (kUsage) if settings contradict each other, regardless of the scene: an unknown
/// method, a composite-only method for layers, a layer limit for a method that captures all layers
/// at once, a blended tail without a composite.
void checkSettings(const CaptureSettings& settings);

/// Throws Error (kUsage) if the settings cannot be used for a view with View::rays: an approximate
/// method, or a clip volume.
void checkRays(const View& view, const CaptureSettings& settings);

/// Throws Error (kUsage) if the settings cannot be used for a scene with Gaussian splats: an
/// approximate method, a lens, a clip volume.
void checkSplats(const View& view, const CaptureSettings& settings);

/// Throws Error (kUsage) if SplatBlending::kDisplay is set for layers, or for a scene that does not
/// consist of splats alone.
void checkSplatBlending(const PosedScene& posed, const CaptureSettings& settings);

/// Whether a capture may skip fragments behind opaque surfaces because its composite is exact and
/// has all layers. Opaque fragments have alpha 1, so hidden fragments cannot change such a
/// composite.
bool skipsHidden(const CaptureSettings& settings);

/// The planner of one plan.
class GlPlanner {
  public:
    /// All arguments must outlive this object. `plan` must have its view and settings.
    GlPlanner(BandRenderer& renderer, const DrawList& draws, StageTimes& times, GlPlan& plan,
              const Progress& progress);

    /// Runs the count pass and completes the plan. Also merges or composites samples if this is
    /// necessary for counting. Throws Error (kMemory) if a single row exceeds the budget.
    void count();
    /// Returns the plan for sinks.
    Plan plan() const;

  private:
    void chooseSurfaces();
    bool shadesPixels() const;
    void checkShadePer() const;
    bool countVisible();
    void countClip();
    void keepCounts(const BandCosts& costs);
    void countSamples();
    void countMerged();
    void limitLayers();
    const DepthComplexity& found() const { return plan_.merged ? *plan_.merged : *plan_.counted; }
    void report(double from, double to, double share) const;

    BandRenderer& renderer_;
    const DrawList& draws_;
    StageTimes& times_;
    GlPlan& plan_;
    const Progress& progress_;
};

}  // namespace peeler
