// SPDX-License-Identifier: Apache-2.0
// The hits of pictures with rays of their own, found by the RayTracer.
#pragma once

#include <memory>

#include "core/fragments/hit_source.h"

namespace peeler {

/// A source that traces views with View::rays, and passes all other views to another source. Hits
/// are those of RayTracer; Z (LayeredImage::z) is the distance along the ray. The bands do not
/// affect the hits.
class TracedHits final : public HitSource {
  public:
    /// `others` must outlive this source; without it, this source takes only views with View::rays.
    /// The first of them builds the RayTracer.
    explicit TracedHits(PosedScene posed, HitSource* others = nullptr);
    ~TracedHits() override;
    TracedHits(const TracedHits&) = delete;
    TracedHits& operator=(const TracedHits&) = delete;

    /// Finds all hits, and keeps those of the first rows up to a part of the memory budget, so that
    /// capture() need not find them again. Throws like RayTracer::RayTracer(), and Error (kMemory)
    /// if the budget is too small for it. Throws Error (kInternal) for HitMode::kSloped. Textures
    /// are filtered over the footprints of pixels.
    CapturePlan plan(const View& view, const CaptureSettings& settings,
                     const Progress& progress = {}) override;
    CaptureReport capture(const CapturePlan& plan, Sink& sink,
                          const Progress& progress = {}) override;
    /// Finds the hits of a band of a plan for a view with View::rays. The band must be as wide as
    /// the crop. Overwrites `out`, except that it keeps its memory.
    void captureBand(const CapturePlan& plan, const Window& band, LayeredImage& out);
    std::uint64_t forecastMemory(const CapturePlan& plan, const Sink& sink) override;
    const PosedScene& posed() const override;
    bool prefersLines() const override;
    StageTimes takeTimes() override;

  private:
    struct State;
    std::unique_ptr<State> state_;
};

}  // namespace peeler
