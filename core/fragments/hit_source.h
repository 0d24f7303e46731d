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

/// Statistics of a capture.
struct CaptureReport {
    int passes = 0;  ///< geometry passes over a band, without the count pass
    int bands = 0;
    double largest_correction = 0;  ///< change of a hit's Z by refinement, scene units
};

/// A Plan, with the data that its HitSource needs to capture it.
struct CapturePlan : Plan {
    /// Data that a HitSource attaches to its plan; opaque to everyone else.
    struct Details {
        virtual ~Details() = default;
    };
    std::shared_ptr<Details> details{};
};

/// A posed scene whose hits are counted and captured bundle by bundle, for any number of bundles.
/// Features that need only hits (rays, maps, parity, voxels, next hits of points, baking) take a
/// HitSource and work with any of them, with or without GL; features that need pictures take a
/// GlRenderer. All sources use the same Plan, bands, Sink and LayeredImage; only at the edges of
/// triangles may their hits differ.
///
/// A source belongs to the thread that made it; only that thread may call it.
class HitSource {
  public:
    virtual ~HitSource() = default;

    /// Runs the count pass. `settings.hit_mode` must request hits; only a GlRenderer accepts
    /// HitMode::kNone, a picture. `progress` receives the share done of the total work of plan()
    /// and capture(); capture() continues from there. Throws Error (kMemory) if a single row
    /// exceeds the budget, and (kInternal) if the settings do not support hits.
    ///
    /// The latest plan is the fastest to capture, because results of planning may be kept for it.
    virtual CapturePlan plan(const View& view, const CaptureSettings& settings,
                             const Progress& progress = {}) = 0;

    /// Captures the plan and passes each band to the sink. The caller must call begin() and
    /// finish() of the sink. Throws like the sink, and Error (kInternal) if any ray's hits differ
    /// in number from the count, or if the plan belongs to another source.
    virtual CaptureReport capture(const CapturePlan& plan, Sink& sink,
                                  const Progress& progress = {}) = 0;

    /// Returns an estimate of the peak resident bytes of the process while capture() passes the
    /// plan's bands to this sink (whose begin() need not have been called): the bytes resident now
    /// plus those of the bands and the sink. Throws like capture() if the budget does not allow it.
    virtual std::uint64_t forecastMemory(const CapturePlan& plan, const Sink& sink) = 0;

    /// Returns the captured scene, which also resolves the keys of hits.
    virtual const PosedScene& posed() const = 0;

    /// Whether the next surfaces seen from scattered points are found faster along a line from each
    /// point (core/bake/visibility_rays.h) than among all hits of bundles.
    virtual bool prefersLines() const { return false; }

    /// Returns the times of the stages since the last call.
    virtual StageTimes takeTimes() = 0;
};

}  // namespace peeler
