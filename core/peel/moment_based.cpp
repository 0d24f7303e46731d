// SPDX-License-Identifier: Apache-2.0
// Moment-based transparency (Münstermann, Krumpen, Klein & Peters, "Moment-Based Order-Independent
// Transparency", I3D 2018) with four power moments in 32-bit float: the first pass sums the moments
// of absorbance over depth, the second weights each colour by the transmittance that they give at
// its depth. With coloured opacity, the weights follow the mean opacity.
#include "core/peel/composite_targets.h"

namespace peeler {

std::unique_ptr<CompositeMethod> makeMomentBased() {
    constexpr unsigned kParts = CompositeTargets::kBack | CompositeTargets::kTail |
                                CompositeTargets::kCoverage | CompositeTargets::kMoments;
    return std::make_unique<Unordered>(kParts, &CompositeTargets::addMomentWeighted, "TAIL_FIRST");
}

}  // namespace peeler
