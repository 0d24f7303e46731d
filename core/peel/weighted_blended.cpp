// SPDX-License-Identifier: Apache-2.0
// Weighted blended transparency (McGuire & Bavoil, "Weighted Blended Order-Independent
// Transparency", Journal of Computer Graphics Techniques 2(2), 2013): the mean of all colours,
// weighted by opacity and distance (equation 7, distances in scene units), with the exact opacity
// of all fragments.
#include "core/peel/composite_targets.h"

namespace peeler {

std::unique_ptr<CompositeMethod> makeWeightedBlended() {
    constexpr unsigned kParts =
        CompositeTargets::kBack | CompositeTargets::kTail | CompositeTargets::kCoverage;
    return std::make_unique<Unordered>(kParts, &CompositeTargets::addDepthWeighted, "TAIL_FIRST");
}

}  // namespace peeler
