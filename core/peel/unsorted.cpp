// SPDX-License-Identifier: Apache-2.0
// Plain "over" blending in draw order: what a renderer shows that does not care, and the thing
// everyone complains about. One geometry pass. Over an opaque bound: a second one.
#include "core/peel/composite_targets.h"
#include "core/peel/method.h"

namespace peeler {
namespace {

constexpr unsigned kParts = CompositeTargets::kBack;

class Unsorted final : public CompositeMethod {
  public:
    std::uint64_t tileBytes(std::uint64_t tile_pixels, bool) const override {
        return CompositeTargets::bytes(kParts, tile_pixels);
    }

    int composite(SceneRasterizer& rasterizer, const CompositeArea& area) override {
        targets_.begin(rasterizer, area.window, kParts);
        const int passes = targets_.addOpaque(rasterizer, area.window) +
                           targets_.blendUnsorted(rasterizer, area.window);
        targets_.resolve(rasterizer, area.window);
        return passes;
    }

  private:
    CompositeTargets targets_;
};

}  // namespace

std::unique_ptr<CompositeMethod> makeUnsorted() {
    return std::make_unique<Unsorted>();
}

}  // namespace peeler
