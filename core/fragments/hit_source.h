// SPDX-License-Identifier: Apache-2.0
// Sources of ray hits: GL (core/capture/gl_renderer.h) or the CPU (core/raster).
#pragma once

#include <cstdint>
#include <memory>

#include <peeler/capture_settings.h>
#include <peeler/sink.h>
#include <peeler/stage_times.h>
#include <peeler/view.h>
#include <peeler/work.h>
#include "core/scene/posed_scene.h"

namespace peeler {

struct CaptureReport {
    int passes = 0;  ///< geometry passes per band, without the count pass
    int bands = 0;
    double largest_correction = 0;  ///< largest change of a hit's Z by refinement, scene units
};

/// A capture plan, with the capture data of the HitSource that made the plan.
struct CapturePlan : Plan {
    /// Data that only this HitSource understands.
    struct Details {
        virtual ~Details() = default;
    };
    std::shared_ptr<Details> details{};
    std::uint64_t without_ray = 0;  ///< number of pixels of the crop that have no ray (View::rays)
};

/// A source of ray hits: counts and captures the hits of a posed scene, bundle by bundle. Features
/// that need only hits (rays, maps, parity, voxels, next hits of points, baking) work with any
/// HitSource, with or without GL. Features that need pictures use a GlRenderer. All sources use the
/// same Plan, bands, Sink and LayeredImage. Their hits may differ only at the edges of triangles.
///
/// Only the thread that made a source may call it.
class HitSource {
  public:
    virtual ~HitSource() = default;

    /// Runs the count pass. `settings.hit_mode` must request hits; only a GlRenderer accepts
    /// HitMode::kNone (a picture). `progress` receives the completed share of the total work of
    /// plan() and capture(); capture() continues from this share. Throws Error (kMemory) if a
    /// single row exceeds the budget, and (kInternal) if the settings do not support hits.
    ///
    /// The latest plan is the fastest to capture, because the source may keep planning results for
    /// it.
    virtual CapturePlan plan(const View& view, const CaptureSettings& settings,
                             const Progress& progress = {}) = 0;

    /// Captures the plan and passes each band to the sink. The caller must call the sink's begin()
    /// and finish(). Throws like the sink, and Error (kInternal) if the number of any ray's hits
    /// differs from its count, or if the plan belongs to another source.
    virtual CaptureReport capture(const CapturePlan& plan, Sink& sink,
                                  const Progress& progress = {}) = 0;

    /// Returns an estimate of the peak resident bytes of the process while capture() passes the
    /// plan's bands to this sink: the bytes resident now plus those of the bands and the sink. The
    /// sink's begin() need not have been called. Throws like capture() if the budget is too small.
    virtual std::uint64_t forecastMemory(const CapturePlan& plan, const Sink& sink) = 0;

    /// Returns the captured scene, which also resolves the keys of hits.
    virtual const PosedScene& posed() const = 0;

    /// Which way is faster to find the next surface from each of many scattered points. True:
    /// tracing a line from each point (core/bake/visibility_rays.h). False: tracing bundles with
    /// this source and searching all their hits.
    virtual bool prefersLines() const { return false; }

    /// Returns the times of the stages since the previous call.
    virtual StageTimes takeTimes() = 0;
};

}  // namespace peeler
