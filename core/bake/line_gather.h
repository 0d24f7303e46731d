// SPDX-License-Identifier: Apache-2.0
// Gathering along visibility rays from each receiver.
#pragma once

#include <vector>

#include "core/bake/gather.h"
#include "core/scene/posed_scene.h"

namespace peeler {

/// Gathers along lines from each receiver, traced on the CPU (VisibilityRays). Exact except for
/// rounding and for hits nearer than 1e-4 of the scene's diagonal, which are ignored as the
/// receiver's own surface. Works only for integrators that need no channels. Uses only the faces
/// and the memory budget of `capture`. Adds to `sums`, one per receiver. The result does not depend
/// on the number of threads or on memory. Throws Error (kMemory) before any work is done.
void gatherByLines(const PosedScene& posed, const CaptureSettings& capture, const GatherJob& job,
                   std::vector<Sum>& sums, const Progress& progress);

/// Returns the value that gatherByLines() would pass to `job.tell`.
std::uint64_t forecastLines(const PosedScene& posed, const CaptureSettings& capture,
                            const GatherJob& job);

}  // namespace peeler
