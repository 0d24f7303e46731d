// SPDX-License-Identifier: Apache-2.0
// Sources of the hits of rays: GL (core/capture/gl_renderer.h) or the CPU (core/raster).
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

/// What capturing a picture took.
struct CaptureReport {
    int passes = 0;  ///< geometry passes over a band, the count pass not included
    int bands = 0;
    double largest_correction = 0;  ///< of a hit's Z by refining, scene units
};

/// A Plan, and what the HitSource that has made it needs to capture it.
struct CapturePlan : Plan {
    /// What a source keeps of a plan.
    struct Details {
        virtual ~Details() = default;
    };
    std::shared_ptr<Details> details{};
};

/// A scene in a pose whose hits are counted and captured bundle by bundle; any number of them. What
/// needs hits alone (rays, maps, parity, voxels, next hits of points, baking) takes a HitSource and
/// works with every one of them, with or without GL; what needs pictures takes a GlRenderer. All
/// sources have the same Plan, bands, Sink and LayeredImage; at the edges of triangles their hits
/// may differ.
///
/// A source belongs to the thread that has made it: that one alone calls it, one call at a time.
class HitSource {
  public:
    virtual ~HitSource() = default;

    /// The count pass. `settings.hit_mode` must ask for hits; nothing but a GlRenderer takes
    /// HitMode::kNone, a picture. `progress` is called with the share of the work, plan() and
    /// capture() together, that is done; capture() goes on from there. Throws Error (kMemory) if
    /// one row does not fit the budget, and (kInternal) for settings that do not go with hits.
    ///
    /// The latest plan is captured soonest: what planning has found may be kept for it.
    virtual CapturePlan plan(const View& view, const CaptureSettings& settings,
                             const Progress& progress = {}) = 0;

    /// Captures what the plan promises and hands each band to the sink. begin() and finish() of the
    /// sink are the caller's. Throws what the sink throws, and Error (kInternal) if any ray's hits
    /// differ in number from the count, or the plan is another source's.
    virtual CaptureReport capture(const CapturePlan& plan, Sink& sink,
                                  const Progress& progress = {}) = 0;

    /// How many bytes the process will have resident at most, as far as it is known, while
    /// capture() hands the plan's bands to such a sink (whose begin() need not have been called):
    /// what is resident now, and what its bands and the sink take. Throws like capture() if the
    /// budget does not allow it.
    virtual std::uint64_t forecastMemory(const CapturePlan& plan, const Sink& sink) = 0;

    /// What is captured, and what the keys of hits stand for.
    virtual const PosedScene& posed() const = 0;

    /// Whether what scattered points see next is found sooner along lines of their own
    /// (core/bake/visibility_rays.h) than among all hits of bundles.
    virtual bool prefersLines() const { return false; }

    /// What the stages have taken since the last call.
    virtual StageTimes takeTimes() = 0;
};

}  // namespace peeler
