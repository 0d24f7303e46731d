// SPDX-License-Identifier: Apache-2.0
// The hits of rays with Gaussian splats, among those with surfaces.
#pragma once

#include "core/fragments/hit_source.h"
#include "core/splats/splat_layers.h"

namespace peeler {

/// A source that adds the splats of the scene to the hits of another source. A ray hits the splats
/// that have fragments in its pixel, at the depths of their largest responses (SplatOrder::kRay),
/// behind surfaces of the same Z. Bands have colours: those of splats, and 0 for surfaces. Views
/// with View::rays are not supported.
class SplatHits final : public HitSource {
  public:
    /// `surfaces` must outlive this source.
    explicit SplatHits(HitSource& surfaces);

    /// Captures the surfaces to count the hits. Throws Error (kInternal) for HitMode::kSloped.
    CapturePlan plan(const View& view, const CaptureSettings& settings,
                     const Progress& progress = {}) override;
    CaptureReport capture(const CapturePlan& plan, Sink& sink,
                          const Progress& progress = {}) override;
    std::uint64_t forecastMemory(const CapturePlan& plan, const Sink& sink) override;
    const PosedScene& posed() const override { return surfaces_.posed(); }
    bool prefersLines() const override { return surfaces_.prefersLines(); }
    StageTimes takeTimes() override;

  private:
    HitSource& surfaces_;
    SplatLayers splats_;
    StageTimes times_;
};

}  // namespace peeler
