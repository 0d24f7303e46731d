// SPDX-License-Identifier: Apache-2.0
// The GL renderer: counts, plans and captures the views of a scene, band by band.
#pragma once

#include <memory>
#include <vector>

#include <peeler/gl_layers.h>
#include "core/fragments/hit_source.h"
#include "core/fragments/surface_channels.h"
#include "core/gl/context.h"

namespace peeler {

/// A renderer of one uploaded scene, for any number of views, pictures or rays.
class GlRenderer final : public HitSource {
  public:
    /// Uploads the scene. The context must outlive this object. Throws Error (kMemory) if the
    /// driver runs out of memory, (kInput) if a texture exceeds the driver's limit.
    GlRenderer(gl::Context& context, PosedScene posed);
    /// Creates a renderer of splats alone (hasOnlySplats()), which needs no context.
    explicit GlRenderer(PosedScene posed);
    ~GlRenderer() override;
    GlRenderer(const GlRenderer&) = delete;
    GlRenderer& operator=(const GlRenderer&) = delete;

    /// Sets another pose of the same scene (one of the file's `scenes`), from the next plan() on.
    /// Uploads only the parts that moved. Plans of earlier poses can no longer be captured. Throws
    /// Error (kInternal) unless canShow().
    void setPose(PosedScene posed);
    /// Whether a pose can be shown: without a context, only splats can.
    bool canShow(const PosedScene& posed) const;

    /// Sets the frame that motion is measured against in later captures.
    void setNextFrame(NextFrame next);

    /// Counts the layers. If there are several samples per pixel, first merges the samples. Throws
    /// like checkSettings() (gl_planner.h), and Error (kDevice) if the context is lost.
    CapturePlan plan(const View& view, const CaptureSettings& settings,
                     const Progress& progress = {}) override;

    /// If CaptureSettings::composite is set, each non-empty pixel has one fragment: the composite.
    CaptureReport capture(const CapturePlan& plan, Sink& sink,
                          const Progress& progress = {}) override;

    /// Returns the bands of a plan for captureOnGpu(). Throws like capture() if the budget is too
    /// small.
    std::vector<Window> bandsOnGpu(const CapturePlan& plan);
    /// Captures a band into GL buffers, which are valid until the next capture. The plan must be
    /// for layers without channels or merged samples. Throws like capture().
    GlLayers captureOnGpu(const CapturePlan& plan, const Window& band,
                          const Progress& progress = {});

    std::uint64_t forecastMemory(const CapturePlan& plan, const Sink& sink) override;

    const PosedScene& posed() const override;
    StageTimes takeTimes() override;

  private:
    struct State;
    std::unique_ptr<State> state_;
};

}  // namespace peeler
