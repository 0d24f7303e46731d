// SPDX-License-Identifier: Apache-2.0
// Receivers gather along the rays of bundles.
#pragma once

#include <vector>

#include "core/bake/gather.h"

namespace peeler {

/// Likewise along the ray of a bundle that is nearest to it. `capture` asks for hits with slopes
/// and with the integrator's channels. Throws what captures throw.
void gatherByBundles(HitSource& source, const CaptureSettings& capture, const GatherJob& job,
                     std::vector<Sum>& sums, const Progress& progress);

/// The most that gatherByBundles() would tell. Progress is that of counting.
std::uint64_t forecastBundles(HitSource& source, const CaptureSettings& capture,
                              const GatherJob& job, const Progress& progress);

}  // namespace peeler
