// SPDX-License-Identifier: Apache-2.0
// Two ways to what receivers see along directions: lines of their own, and bundles of rays.
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
    /// Unit vectors. Receivers that face the other way look against them.
    std::span<const glm::dvec3> directions;
    ReportMemory tell{};  ///< as bake() has it
};

/// What receivers need has to leave room for what else there is: throws Error (kMemory) unless so
/// many bytes, besides what is resident, are within the budget.
void checkReceiverMemory(std::uint64_t bytes, std::size_t receivers, const MemoryBudget& budget);

}  // namespace peeler
