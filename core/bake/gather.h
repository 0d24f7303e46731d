// SPDX-License-Identifier: Apache-2.0
// The input of gatherByLines() and gatherByBundles().
#pragma once

#include <glm/glm.hpp>
#include <span>
#include <vector>

#include <peeler/capture_settings.h>
#include "core/bake/bake.h"
#include "core/bake/integrators.h"
#include "core/fragments/hit_source.h"

namespace peeler {

struct GatherJob {
    const Receivers& receivers;
    const BakeSettings& settings;
    Integrator& integrator;
    /// Unit vectors. A receiver that faces away from a direction looks along the opposite vector.
    std::span<const glm::dvec3> directions;
    ReportMemory tell{};  ///< called as in bake(); may be empty
};

/// Throws Error (kMemory) if resident memory plus `bytes` exceeds the budget.
void checkReceiverMemory(std::uint64_t bytes, std::size_t receivers, const MemoryBudget& budget);

}  // namespace peeler
