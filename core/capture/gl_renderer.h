// SPDX-License-Identifier: Apache-2.0
// From a scene and a view to bands of fragments: count, plan, capture.
#pragma once

#include <memory>

#include "core/fragments/hit_source.h"
#include "core/fragments/surface_channels.h"
#include "core/gl/context.h"

namespace peeler {

/// Owns the uploaded scene. One GlRenderer serves any number of views, pictures as well as rays.
class GlRenderer final : public HitSource {
  public:
    /// Uploads the scene. The context must outlive the GlRenderer. Throws Error (kMemory) if the
    /// driver has no room, (kInput) if a texture is larger than it takes.
    GlRenderer(gl::Context& context, PosedScene posed);
    ~GlRenderer() override;
    GlRenderer(const GlRenderer&) = delete;
    GlRenderer& operator=(const GlRenderer&) = delete;

    /// Shows the same scene (of the file's `scenes`) in another pose from the next plan() on. Only
    /// what has moved is uploaded again. Plans of another pose cannot be captured any more.
    void setPose(PosedScene posed);

    /// What motion is measured against in the captures to come.
    void setNextFrame(NextFrame next);

    /// Several samples have to be merged to be counted. Throws like checkSettings() (gl_planner.h),
    /// too, and Error (kDevice) if the context is lost.
    CapturePlan plan(const View& view, const CaptureSettings& settings,
                     const Progress& progress = {}) override;

    /// With CaptureSettings::composite a band has one fragment in every pixel that has any: the
    /// composite.
    CaptureReport capture(const CapturePlan& plan, Sink& sink,
                          const Progress& progress = {}) override;

    std::uint64_t forecastMemory(const CapturePlan& plan, const Sink& sink) override;

    const PosedScene& posed() const override;
    StageTimes takeTimes() override;

  private:
    struct State;
    std::unique_ptr<State> state_;
};

}  // namespace peeler
