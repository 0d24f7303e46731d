// SPDX-License-Identifier: Apache-2.0
// All hits of bundles of rays without GL: rasterised on the CPU, exactly and in integers.
#pragma once

#include <cstddef>
#include <memory>

#include "core/fragments/hit_source.h"

namespace peeler {

/// Finds the hits of bundles, parallel or through a pinhole, by rasterising triangles.
///
/// Corners are snapped to a grid (CornerGrid), and a ray hits a triangle if it goes through the
/// snapped one, or through its left or top edges: exactly, so that a ray through an edge that two
/// triangles share hits one of them, and a closed surface an even number of times. Z is that of the
/// triangle as it is where the ray meets its plane, in double precision, rounded once. Hits are
/// ordered by that and then by draw order. All bits are the same on every machine and with any
/// number of threads, bands and budget.
///
/// What counts is what core/README.md ("What a fragment is") says, textures being looked up at
/// their finest level. Triangles that reach beyond the grid are cut off there, without cracks; one
/// with a corner that is not a finite number is not hit.
///
/// HitMode::kRefined and kRaw are the same. Lines and points are not hit.
class HitRasterizer final : public HitSource {
  public:
    /// Throws Error (kInput) if the scene has 2^32 triangles or more.
    explicit HitRasterizer(PosedScene posed);
    ~HitRasterizer() override;
    HitRasterizer(const HitRasterizer&) = delete;
    HitRasterizer& operator=(const HitRasterizer&) = delete;

    /// Throws Error (kInternal) for settings that ask for a picture, or for what only pictures have
    /// (clip volumes, hidden surfaces, composites, samples, a limit of layers), and (kUsage) if a
    /// bundle has more than 65,536 rays on a side.
    CapturePlan plan(const View& view, const CaptureSettings& settings,
                     const Progress& progress = {}) override;
    CaptureReport capture(const CapturePlan& plan, Sink& sink,
                          const Progress& progress = {}) override;
    std::uint64_t forecastMemory(const CapturePlan& plan, const Sink& sink) override;
    const PosedScene& posed() const override;
    bool prefersLines() const override { return true; }
    StageTimes takeTimes() override;

    /// Of the plan that was made or captured last: 2^gridBits() steps of the grid lie between two
    /// rays.
    int gridBits() const;
    /// Likewise: into how many sections of rows the picture was cut so that what triangles
    /// cover of one fits the budget. Of a single one it is found once, for plan() and the
    /// capture() that follows.
    std::size_t sections() const;

  private:
    struct State;
    std::unique_ptr<State> state_;
};

}  // namespace peeler
