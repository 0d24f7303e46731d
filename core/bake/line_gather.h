// SPDX-License-Identifier: Apache-2.0
// Gathering along each receiver's own visibility rays.
#pragma once

#include <vector>

#include "core/bake/gather.h"
#include "core/scene/posed_scene.h"

namespace peeler {

/// Gathers along each receiver's own lines, traced on the CPU (VisibilityRays). Exact except for
/// rounding and for the receiver's own surface: hits nearer than 1e-4 of the scene's diagonal are
/// ignored. For integrators without channels. `capture` gives the faces that occlude, and the
/// budget. Adds to `sums`, one per receiver. The result does not depend on the number of threads or
/// on memory. Throws Error (kMemory) before any work is done.
void gatherByLines(const PosedScene& posed, const CaptureSettings& capture, const GatherJob& job,
                   std::vector<Sum>& sums, const Progress& progress);

/// Returns the value that gatherByLines() would report.
std::uint64_t forecastLines(const PosedScene& posed, const CaptureSettings& capture,
                            const GatherJob& job);

}  // namespace peeler
