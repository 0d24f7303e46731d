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
        targets_.allocate(rasterizer);
        // Behind everything: no fragment has depth 0. A pixel without the layer keeps the key (1,
        // 0), in front of which there is nothing: it stays finished.
        targets_.clear(rasterizer, area, 1, 0, 0xFFFFFFFFU);
        for (std::uint32_t layer = 0; layer < layers; ++layer) {
            const int current = static_cast<int>(layer % 2), previous = 1 - current;
            targets_.clear(rasterizer, area, current, 1, 0);
            targets_.bindForReading(rasterizer.functions(), previous);
            rasterizer.draw(
                {.fragment_shader = "peel_layer_backward.frag",
                 .shades = true,
                 .framebuffer = targets_.framebuffer(current, LayerTargets::kKeyAndColor),
                 .depth_test = gl::DepthTest::kFarthest},
                area);
            targets_.store(rasterizer, area, current);
        }
        return static_cast<int>(layers);
    }

  private:
    LayerTargets targets_;
};

}  // namespace

std::unique_ptr<PeelMethod> makeBackToFront() {
    return std::make_unique<BackToFront>();
}

}  // namespace peeler
