// SPDX-License-Identifier: Apache-2.0
// Front-to-back depth peeling (Everitt, "Interactive Order-Independent Transparency", 2001). Keys
// are (depth, primitive) instead of only depth, so that coincident fragments are peeled one by one.
// The count pass has counted the layers, so Everitt's occlusion query after each pass is
// unnecessary.
#include "core/peel/composite_targets.h"

namespace peeler {
namespace {

/// Blends each layer under the layers in front: C += (1 − A)·c, A += (1 − A)·a. Accumulates the
/// opacity A instead of Everitt's product of transmittances, which would round differently from
/// compositeOver().
class FrontToBackComposite final : public CompositeMethod {
  public:
    std::uint64_t tileBytes(std::uint64_t tile_pixels,
                            const CaptureSettings& settings) const override {
        return LayerTargets::bytes(tile_pixels, settings) +
               CompositeTargets::bytes(CompositeTargets::kFront | CompositeTargets::kTail,
                                       tile_pixels);
    }

    int composite(SceneRasterizer& rasterizer, const CompositeArea& area) override {
        targets_.begin(rasterizer, area.window,
                       CompositeTargets::kFront | (area.tail ? CompositeTargets::kTail : 0U));
        layers_.begin(rasterizer, area.window, kNearestFirst);
        const int passes = compositeNearestFirst(rasterizer, area, layers_, targets_);
        targets_.resolve(rasterizer, area.window);
        return passes;
    }

  private:
    LayerTargets layers_;
    CompositeTargets targets_;
};

}  // namespace

std::unique_ptr<LayerMethod> makeFrontToBack() {
    return std::make_unique<PeeledLayers>(kNearestFirst);
}

std::unique_ptr<CompositeMethod> makeFrontToBackComposite() {
    return std::make_unique<FrontToBackComposite>();
}

}  // namespace peeler
