// SPDX-License-Identifier: Apache-2.0
// Back-to-front depth peeling (Everitt 2001 with reversed tests): the farthest layer first.
#include "core/peel/composite_targets.h"

namespace peeler {
namespace {

/// Blends each layer over the layers behind it. Layers beyond the limit are farthest, so they are
/// peeled first. They are dropped, or summed as the tail.
class BackToFrontComposite final : public CompositeMethod {
  public:
    std::uint64_t tileBytes(std::uint64_t tile_pixels,
                            const CaptureSettings& settings) const override {
        return LayerTargets::bytes(tile_pixels, settings) +
               CompositeTargets::bytes(CompositeTargets::kBack | CompositeTargets::kTail,
                                       tile_pixels);
    }

    int composite(SceneRasterizer& rasterizer, const CompositeArea& area) override {
        const unsigned parts = CompositeTargets::kBack | (area.tail ? CompositeTargets::kTail : 0U);
        targets_.begin(rasterizer, area.window, parts);
        layers_.begin(rasterizer, area.window, kFarthestFirst);
        const int passes = layers_.peel(
            rasterizer, area.window, area.deepest, kFarthestFirst, [&](int layer, int side) {
                layers_.blend(rasterizer, area.window, side,
                              {.definitions = area.tail ? "BACKWARD TAIL" : "BACKWARD",
                               .framebuffer = targets_.framebuffer(rasterizer, parts),
                               .blend = CompositeTargets::blending(parts),
                               .argument = {{layer, 0, 0, 0}}});
            });
        targets_.resolve(rasterizer, area.window);
        return passes;
    }

  private:
    LayerTargets layers_;
    CompositeTargets targets_;
};

}  // namespace

std::unique_ptr<LayerMethod> makeBackToFront() {
    return std::make_unique<PeeledLayers>(kFarthestFirst);
}

std::unique_ptr<CompositeMethod> makeBackToFrontComposite() {
    return std::make_unique<BackToFrontComposite>();
}

}  // namespace peeler
