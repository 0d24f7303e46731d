// SPDX-License-Identifier: Apache-2.0
// Plain "over" blending in draw order, as in a renderer that does not sort. Serves for comparison.
#include "core/peel/composite_targets.h"

namespace peeler {

std::unique_ptr<CompositeMethod> makeUnsorted() {
    return std::make_unique<Unordered>(CompositeTargets::kBack, &CompositeTargets::blendUnsorted,
                                       "");
}

}  // namespace peeler
