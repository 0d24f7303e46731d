// SPDX-License-Identifier: Apache-2.0
// Two passes a layer: the first finds the key of the next fragment and shades nothing, the second
// shades the one fragment with that key. Every kept fragment is shaded exactly once, whatever lies
// behind it.
#include "core/peel/layer_targets.h"
#include "core/peel/method.h"

namespace peeler {
namespace {

class TwoPass final : public PeelMethod {
  public:
    bool takesAll() const override { return false; }

    std::uint64_t tileBytes(std::uint64_t tile_pixels, bool float_color) const override {
        return LayerTargets::bytes(tile_pixels, float_color);
    }

    int capture(SceneRasterizer& rasterizer, const Window& area, std::uint32_t layers) override {
        const auto& gl = rasterizer.functions();
        targets_.allocate(rasterizer);
        targets_.clear(rasterizer, area, 1, 1, 0);
        for (std::uint32_t layer = 0; layer < layers; ++layer) {
            const int current = static_cast<int>(layer % 2), previous = 1 - current;
            targets_.clear(rasterizer, area, current, 0, 0);
            targets_.bindForReading(gl, previous);
            rasterizer.draw({.fragment_shader = "peel_key.frag",
                             .framebuffer = targets_.framebuffer(current, LayerTargets::kKey),
                             .depth_test = gl::DepthTest::kNearest},
                            area);
            targets_.bindForReading(gl, current);
            rasterizer.draw({.fragment_shader = "shade_layer.frag",
                             .shades = true,
                             .framebuffer = targets_.framebuffer(current, LayerTargets::kColor)},
                            area);
            targets_.store(rasterizer, area, current);
        }
        return 2 * static_cast<int>(layers);
    }

  private:
    LayerTargets targets_;
};

}  // namespace

std::unique_ptr<PeelMethod> makeTwoPass() {
    return std::make_unique<TwoPass>();
}

}  // namespace peeler
