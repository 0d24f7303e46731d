// SPDX-License-Identifier: Apache-2.0
// Plain "over" blending in draw order: what a renderer shows that does not sort, to compare with.
#include "core/peel/composite_targets.h"

namespace peeler {

std::unique_ptr<CompositeMethod> makeUnsorted() {
    return std::make_unique<Unordered>(CompositeTargets::kBack, &CompositeTargets::blendUnsorted,
                                       "");
}

}  // namespace peeler
