// SPDX-License-Identifier: Apache-2.0
// The count pass of a view, and what follows from it: a GlPlan.
#pragma once

#include <peeler/sink.h>
#include <peeler/work.h>
#include "core/capture/band_renderer.h"
#include "core/capture/gl_plan.h"
#include "core/gl/context.h"
#include "core/scene/draw_list.h"

namespace peeler {

/// Throws Error (kUsage) for what contradicts itself whatever the scene is: an unknown method, one
/// that makes composites only where layers are asked for, a limit on one that takes all at once, a
/// blended tail of layers.
void checkSettings(const CaptureSettings& settings);

/// Makes one plan.
class GlPlanner {
  public:
    /// All must outlive it. `plan` has its view and its settings.
    GlPlanner(BandRenderer& renderer, const DrawList& draws, StageTimes& times, GlPlan& plan,
              const Progress& progress);

    /// Counts, and merges or composites where that has to be done to count; fills the plan in.
    /// Throws Error (kMemory) if one row does not fit the budget.
    void count();
    /// What sinks get of it.
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
