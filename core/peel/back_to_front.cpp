// SPDX-License-Identifier: Apache-2.0
// Back-to-front depth peeling (Everitt 2001 with the tests turned round): the farthest layer first.
#include "core/peel/layer_targets.h"
#include "core/peel/method.h"

namespace peeler {
namespace {

class BackToFront final : public PeelMethod {
  public:
    // A layer's index from the front is known only when all have been peeled, so the lists are put
    // in order afterwards.
    bool takesAll() const override { return true; }

    std::uint64_t tileBytes(std::uint64_t tile_pixels, bool float_color) const override {
        return LayerTargets::bytes(tile_pixels, float_color);
    }

    int capture(SceneRasterizer& rasterizer, const Window& area, std::uint32_t layers) override {
        // Before any layer, behind everything: no fragment has depth 0. In front of the key (1, 0)
        // of a pixel without the layer there is nothing: it stays finished.
        return targets_.peel(rasterizer, area, layers,
                             {.shader = "peel_layer_backward.frag",
                              .depth_test = gl::DepthTest::kFarthest,
                              .first_depth = 0,
                              .first_primitive = 0xFFFFFFFFU,
                              .empty_depth = 1});
    }

  private:
    LayerTargets targets_;
};

}  // namespace

std::unique_ptr<PeelMethod> makeBackToFront() {
    return std::make_unique<BackToFront>();
}

}  // namespace peeler
