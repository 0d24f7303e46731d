// SPDX-License-Identifier: Apache-2.0
// Weighted average (Bavoil & Myers, "Order Independent Transparency with Dual Depth Peeling",
// NVIDIA 2008, section 4): every fragment of a pixel is given the pixel's average colour and
// opacity, so that their order does not matter. One geometry pass. Over an opaque bound: a second
// one.
#include "core/peel/composite_targets.h"
#include "core/peel/method.h"

namespace peeler {
namespace {

constexpr unsigned kParts = CompositeTargets::kBack | CompositeTargets::kTail;

class WeightedAverage final : public CompositeMethod {
  public:
    std::uint64_t tileBytes(std::uint64_t tile_pixels, bool) const override {
        return CompositeTargets::bytes(kParts, tile_pixels);
    }

    int composite(SceneRasterizer& rasterizer, const CompositeArea& area) override {
        targets_.begin(rasterizer, area.window, kParts);
        const int passes = targets_.addOpaque(rasterizer, area.window) +
                           targets_.addFragments(rasterizer, area.window);
        targets_.resolve(rasterizer, area.window, "TAIL_FIRST");
        return passes;
    }

  private:
    CompositeTargets targets_;
};

}  // namespace

std::unique_ptr<CompositeMethod> makeWeightedAverage() {
    return std::make_unique<WeightedAverage>();
}

}  // namespace peeler
