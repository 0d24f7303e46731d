// SPDX-License-Identifier: Apache-2.0
// Weighted sum (Meshkin, "Sort-Independent Alpha Blending", GDC 2007): C = ΣA·C + C_bg·(1 − ΣA).
// The sum of opacities may exceed 1.
#include "core/peel/composite_targets.h"

namespace peeler {

std::unique_ptr<CompositeMethod> makeWeightedSum() {
    return std::make_unique<Unordered>(CompositeTargets::kBack | CompositeTargets::kTail,
                                       &CompositeTargets::addFragments, "TAIL_FIRST WEIGHTED_SUM");
}

}  // namespace peeler
