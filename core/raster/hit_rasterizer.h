// SPDX-License-Identifier: Apache-2.0
// An exact integer CPU rasteriser, which finds all hits of ray bundles without GL.
#pragma once

#include <cstddef>
#include <memory>

#include "core/fragments/hit_source.h"

namespace peeler {

/// Finds the hits of parallel or pinhole bundles by rasterising triangles.
///
/// Corners are snapped to a grid (CornerGrid). A ray hits a triangle if it passes through the
/// inside, or a left or top edge, of the snapped triangle. The test is exact: a ray through an edge
/// shared by two triangles hits one of them, and every ray hits a closed surface an even number of
/// times. Z comes from the plane of the unsnapped triangle at the ray, in double precision, rounded
/// once. Hits are ordered by Z, then by draw order. Results are bit-identical on every machine, for
/// any number of threads and bands, and under any budget.
///
/// core/README.md ("What a fragment is") defines which intersections count. Textures are sampled at
/// their finest level. Triangles that extend beyond the grid are clipped to it, without cracks.
/// Triangles with a non-finite corner are not hit; neither are lines and points. HitMode::kRefined
/// and kRaw give the same result.
class HitRasterizer final : public HitSource {
  public:
    /// Throws Error (kInput) if the scene has 2^32 triangles or more.
    explicit HitRasterizer(PosedScene posed);
    ~HitRasterizer() override;
    HitRasterizer(const HitRasterizer&) = delete;
    HitRasterizer& operator=(const HitRasterizer&) = delete;

    /// Throws Error (kInternal) if the settings request a picture or features that only pictures
    /// have (clip volumes, hidden surfaces, composites, samples, a layer limit), and (kUsage) if a
    /// bundle has more than 65,536 rays per side.
    CapturePlan plan(const View& view, const CaptureSettings& settings,
                     const Progress& progress = {}) override;
    CaptureReport capture(const CapturePlan& plan, Sink& sink,
                          const Progress& progress = {}) override;
    std::uint64_t forecastMemory(const CapturePlan& plan, const Sink& sink) override;
    const PosedScene& posed() const override;
    bool prefersLines() const override { return true; }
    StageTimes takeTimes() override;

    /// Returns the number of grid bits in the last plan or capture: the grid has 2^gridBits() steps
    /// between two rays.
    int gridBits() const;
    /// Returns the number of row sections in the last plan or capture. The picture is divided into
    /// sections so that the spans of one section fit the memory budget. If there is only one
    /// section, plan() finds its spans, and the following capture() reuses them.
    std::size_t sections() const;

  private:
    struct State;
    std::unique_ptr<State> state_;
};

}  // namespace peeler
