// SPDX-License-Identifier: Apache-2.0
// Layers peeled one after the other from either end, and stored.
#pragma once

#include "core/capture/method.h"
#include "core/peel/layer_targets.h"

namespace peeler {

class PeeledLayers final : public LayerMethod {
  public:
    explicit PeeledLayers(const PeelDirection& direction) : direction_(direction) {}

    // From behind, a layer's index from the front is known only when all have been peeled, so the
    // lists are put in order afterwards.
    bool takesAll() const override { return !direction_.nearest_first; }

    std::uint64_t tileBytes(std::uint64_t tile_pixels, bool float_color) const override {
        return LayerTargets::bytes(tile_pixels, float_color);
    }

    int capture(SceneRasterizer& rasterizer, const LayerArea& area) override {
        layers_.begin(rasterizer, area.window, direction_);
        return layers_.peel(rasterizer, area.window, area.layers, direction_,
                            [&](int, int side) { layers_.store(rasterizer, area.window, side); });
    }

  private:
    const PeelDirection& direction_;
    LayerTargets layers_;
};

}  // namespace peeler
