// SPDX-License-Identifier: Apache-2.0
// The memory costs of a GlPlan's bands, and the band sizes that the budget allows.
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

/// The method of a plan, which captures layers or composites on the fly.
struct PlanMethods {
    std::unique_ptr<LayerMethod> layers{};
    std::unique_ptr<CompositeMethod> composite{};  ///< if set, used instead of `layers`
};

/// Returns the memory that a sink needs for a plan's bands, in addition to the band itself.
MemoryUse sinkUse(const GlPlan& details, const Plan& plan, const Sink& sink);

/// The costs of a plan's bands. The plan must outlive this object.
class BandBudget {
  public:
    /// `overlaps`: whether the GPU captures a band while the previous band is sorted and passed on.
    BandBudget(const GlPlan& plan, const PlanMethods& methods, const BandCapture& capture,
               bool overlaps);

    BandCosts& costs() { return costs_; }

    /// Returns the limits of bands. Throws like bandLimits().
    BandLimits limits() const;
    /// Returns the bands that the picture is divided into. Throws like cutBands().
    std::vector<Window> cut(const BandLimits& limits) const;
    /// Returns the bands of a count pass, which stores no fragments.
    std::vector<Window> cutForCounting(const BandLimits& limits) const;
    /// Returns the bytes of the largest of these bands, without the fixed costs.
    std::uint64_t largest(const std::vector<Window>& bands) const;

  private:
    std::uint64_t rowFragments(int y) const;
    std::uint64_t clipFragments(int y) const;

    const GlPlan& plan_;
    bool composites_;  ///< whether bands are composited on the fly
    BandCosts costs_;
};

}  // namespace peeler
