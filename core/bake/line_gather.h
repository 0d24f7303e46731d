// SPDX-License-Identifier: Apache-2.0
// Receivers gather along visibility rays of their own.
#pragma once

#include <vector>

#include "core/bake/gather.h"
#include "core/scene/posed_scene.h"

namespace peeler {

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

}  // namespace peeler
