// SPDX-License-Identifier: Apache-2.0
// Weighted average (Bavoil & Myers, "Order Independent Transparency with Dual Depth Peeling",
// NVIDIA 2008, section 4). Every fragment of a pixel gets the pixel's average colour and opacity,
// so the order of fragments does not matter.
#include "core/peel/composite_targets.h"

namespace peeler {

std::unique_ptr<CompositeMethod> makeWeightedAverage() {
    return std::make_unique<Unordered>(CompositeTargets::kBack | CompositeTargets::kTail,
                                       &CompositeTargets::addFragments, "TAIL_FIRST");
}

}  // namespace peeler
