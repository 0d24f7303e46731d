// SPDX-License-Identifier: Apache-2.0
// Two ways to what receivers see along directions: lines of their own, and bundles of rays.
#pragma once

#include <glm/glm.hpp>
#include <span>
#include <vector>

#include <peeler/capture_settings.h>
#include "core/bake/bake.h"
#include "core/bake/integrators.h"
#include "core/capture/hit_source.h"

namespace peeler {

struct GatherJob {
    const Receivers& receivers;
    const BakeSettings& settings;
    Integrator& integrator;
    /// Unit vectors. Receivers that face the other way look against them.
    std::span<const glm::dvec3> directions;
    ReportMemory tell{};  ///< as bake() has it
};

// line_gather.cpp.

/// Every receiver along lines of its own, found on the CPU (VisibilityRays): exact but for rounding
/// and for its own surface, which is what is nearer than 1e-4 of the scene's diagonal. For
/// integrators without channels. `capture`: which faces are in the way, and the budget. Adds to
/// `sums`, one for each receiver; the result does not depend on threads nor memory. Throws Error
/// (kMemory) before anything is done.
void gatherByLines(const PosedScene& posed, const CaptureSettings& capture, const GatherJob& job,
                   std::vector<Sum>& sums, const Progress& progress);

/// What gatherByLines() would tell.
std::uint64_t forecastLines(const PosedScene& posed, const CaptureSettings& capture,
                            const GatherJob& job);

// bundle_gather.cpp.

/// Likewise along the ray of a bundle that is nearest to it. `capture` asks for hits with slopes
/// and with the integrator's channels. Throws what captures throw.
void gatherByBundles(HitSource& source, const CaptureSettings& capture, const GatherJob& job,
                     std::vector<Sum>& sums, const Progress& progress);

/// The most that gatherByBundles() would tell. Progress is that of counting.
std::uint64_t forecastBundles(HitSource& source, const CaptureSettings& capture,
                              const GatherJob& job, const Progress& progress);

/// What receivers need has to leave room for what else there is: throws Error (kMemory) unless so
/// many bytes, besides what is resident, are within the budget.
void checkReceiverMemory(std::uint64_t bytes, std::size_t receivers, const MemoryBudget& budget);

}  // namespace peeler
