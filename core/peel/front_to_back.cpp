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
        // Before any layer, in front of everything: the near plane has depth 1, and keys start
        // at 1.
        return targets_.peel(rasterizer, area, layers,
                             {.shader = "peel_layer.frag",
                              .depth_test = gl::DepthTest::kNearest,
                              .first_depth = 1,
                              .first_primitive = 0,
                              .empty_depth = 0});
    }

  private:
    LayerTargets targets_;
};

}  // namespace

std::unique_ptr<PeelMethod> makeFrontToBack() {
    return std::make_unique<FrontToBack>();
}

}  // namespace peeler
