// SPDX-License-Identifier: Apache-2.0
// Gathering along rays of parallel bundles.
#pragma once

#include <vector>

#include "core/bake/gather.h"

namespace peeler {

/// Gathers from one bundle per direction: each receiver uses the ray nearest to it. `capture` must
/// request hits with slopes (HitMode::kSloped) and the integrator's channels. Throws like
/// HitSource::capture().
void gatherByBundles(HitSource& source, const CaptureSettings& capture, const GatherJob& job,
                     std::vector<Sum>& sums, const Progress& progress);

/// Returns the highest forecast that gatherByBundles() would pass to `job.tell`. Runs only the
/// count passes, and reports their progress.
std::uint64_t forecastBundles(HitSource& source, const CaptureSettings& capture,
                              const GatherJob& job, const Progress& progress);

}  // namespace peeler
