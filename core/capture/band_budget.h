// SPDX-License-Identifier: Apache-2.0
// What the bands of a GlPlan cost, and so how large they may be.
#pragma once

#include <cstdint>
#include <memory>
#include <vector>

#include <peeler/sink.h>
#include <peeler/window.h>
#include "core/capture/band_capture.h"
#include "core/capture/gl_plan.h"
#include "core/capture/method.h"
#include "core/fragments/bands.h"

namespace peeler {

/// The methods of a plan: one captures its layers, or the other composites them on the fly.
struct PlanMethods {
    std::unique_ptr<LayerMethod> layers{};
    std::unique_ptr<CompositeMethod> composite{};  ///< used if there is one
};

/// What a sink of a plan's bands takes besides the band that it is given.
MemoryUse sinkUse(const GlPlan& details, const Plan& plan, const Sink& sink);

/// The costs of a plan's bands as of now; it refers to the plan and the methods.
class BandBudget {
  public:
    /// `overlaps`: a band is captured while the one before is taken.
    BandBudget(const GlPlan& plan, const PlanMethods& methods, const BandCapture& capture,
               bool overlaps, std::uint64_t storage_block_bytes);

    BandCosts& costs() { return costs_; }

    /// Throws like bandLimits().
    BandLimits limits() const;
    /// The bands that the picture is cut into. Throws like cutBands().
    std::vector<Window> cut(const BandLimits& limits) const;
    /// The same of bands that store no fragments: they are only counted.
    std::vector<Window> cutForCounting(const BandLimits& limits) const;
    /// Bytes of the largest of these bands, besides what is fixed.
    std::uint64_t largest(const std::vector<Window>& bands) const;

  private:
    std::uint64_t rowFragments(int y) const;
    std::uint64_t clipFragments(int y) const;

    const GlPlan& plan_;
    bool composites_;  ///< on the fly
    BandCosts costs_;
};

}  // namespace peeler
