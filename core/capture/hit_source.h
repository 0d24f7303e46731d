// SPDX-License-Identifier: Apache-2.0
// Where the hits of rays come from: GL (core/capture/gl_renderer.h) or the CPU (core/raster).
#pragma once

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

    /// The count pass: what capture() will deliver for these arguments. `settings.hit_mode` must
    /// ask for hits; nothing but a GlRenderer takes HitMode::kNone, a picture. `progress` is called
    /// with the share of the work, plan() and capture() together, that is done; capture() goes on
    /// from there. Throws Error (kMemory) if one row does not fit the budget, and (kInternal) for
    /// settings that do not go with hits.
    virtual Plan plan(const View& view, const CaptureSettings& settings,
                      const Progress& progress = {}) = 0;

    /// Captures what the last plan() promised and hands each band to the sink; once per plan().
    /// begin() and finish() of the sink are the caller's. Throws what the sink throws, and Error
    /// (kInternal) if any ray's hits differ in number from the count.
    virtual CaptureReport capture(Sink& sink, const Progress& progress = {}) = 0;

    /// How many bytes the process will have resident at most, as far as it is known, while
    /// capture() hands what the last plan() promised to such a sink (whose begin() need not have
    /// been called): what is resident now, and what its bands and the sink take. Throws like
    /// capture() if the budget does not allow it.
    virtual std::uint64_t forecastMemory(const Sink& sink) = 0;

    /// What is captured, and what the keys of hits stand for.
    virtual const PosedScene& posed() const = 0;

    /// Whether what scattered points see next is found sooner along lines of their own
    /// (core/bake/visibility_rays.h) than among all hits of bundles.
    virtual bool prefersLines() const { return false; }

    /// What the stages have taken since the last call.
    virtual StageTimes takeTimes() = 0;
};

}  // namespace peeler
