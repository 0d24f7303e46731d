// SPDX-License-Identifier: Apache-2.0
// Planning: the count pass of a view, and the GlPlan that follows from it.
#pragma once

#include <peeler/sink.h>
#include <peeler/work.h>
#include "core/capture/band_renderer.h"
#include "core/capture/gl_plan.h"
#include "core/gl/context.h"
#include "core/scene/draw_list.h"

namespace peeler {

/// Throws Error (kUsage) for settings that contradict each other regardless of the scene: an
/// unknown method, a composite-only method for layers, a layer limit on a method that takes all
/// layers at once, a blended tail without a composite.
void checkSettings(const CaptureSettings& settings);

/// The planner of one plan.
class GlPlanner {
  public:
    /// All arguments must outlive this object. The view and the settings of `plan` must be set.
    GlPlanner(BandRenderer& renderer, const DrawList& draws, StageTimes& times, GlPlan& plan,
              const Progress& progress);

    /// Runs the count pass, with merging or compositing where counting requires it, and completes
    /// the plan. Throws Error (kMemory) if a single row exceeds the budget.
    void count();
    /// Returns the plan as passed to sinks.
    Plan plan() const;

  private:
    void chooseSurfaces();
    bool compositeSamples();
    void countClip();
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
