// SPDX-License-Identifier: Apache-2.0
// Weighted sum (Meshkin, "Sort-Independent Alpha Blending", GDC 2007): C = ΣA·C + C_bg·(1 − ΣA).
// One geometry pass. Over an opaque bound: a second one. The sum of opacities may exceed 1.
#include "core/peel/composite_targets.h"
#include "core/peel/method.h"

namespace peeler {
namespace {

constexpr unsigned kParts = CompositeTargets::kBack | CompositeTargets::kTail;

class WeightedSum final : public CompositeMethod {
  public:
    std::uint64_t tileBytes(std::uint64_t tile_pixels, bool) const override {
        return CompositeTargets::bytes(kParts, tile_pixels);
    }

    int composite(SceneRasterizer& rasterizer, const CompositeArea& area) override {
        targets_.begin(rasterizer, area.window, kParts);
        const int passes = targets_.addOpaque(rasterizer, area.window) +
                           targets_.addFragments(rasterizer, area.window);
        targets_.resolve(rasterizer, area.window, "TAIL_FIRST WEIGHTED_SUM");
        return passes;
    }

  private:
    CompositeTargets targets_;
};

}  // namespace

std::unique_ptr<CompositeMethod> makeWeightedSum() {
    return std::make_unique<WeightedSum>();
}

}  // namespace peeler
