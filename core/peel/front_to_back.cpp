// SPDX-License-Identifier: Apache-2.0
// Front-to-back depth peeling (Everitt, "Interactive Order-Independent Transparency", 2001), with
// the key (depth, primitive) in place of depth alone: coincident fragments are peeled one after the
// other.
#include "core/peel/layer_targets.h"
#include "core/peel/method.h"

namespace peeler {
namespace {

class FrontToBack final : public PeelMethod {
  public:
    bool takesAll() const override { return false; }

    std::uint64_t tileBytes(std::uint64_t tile_pixels, bool float_color) const override {
        return LayerTargets::bytes(tile_pixels, float_color);
    }

    int capture(SceneRasterizer& rasterizer, const Window& area, std::uint32_t layers) override {
        targets_.allocate(rasterizer);
        // In front of everything: the near plane has depth 1, and keys start at 1.
        targets_.clear(rasterizer, area, 1, 1, 0);
        for (std::uint32_t layer = 0; layer < layers; ++layer) {
            const int current = static_cast<int>(layer % 2), previous = 1 - current;
            targets_.clear(rasterizer, area, current, 0, 0);
            targets_.bindForReading(rasterizer.functions(), previous);
            rasterizer.draw(
                {.fragment_shader = "peel_layer.frag",
                 .shades = true,
                 .framebuffer = targets_.framebuffer(current, LayerTargets::kKeyAndColor),
                 .depth_test = gl::DepthTest::kNearest},
                area);
            targets_.store(rasterizer, area, current);
        }
        return static_cast<int>(layers);
    }

  private:
    LayerTargets targets_;
};

}  // namespace

std::unique_ptr<PeelMethod> makeFrontToBack() {
    return std::make_unique<FrontToBack>();
}

}  // namespace peeler
