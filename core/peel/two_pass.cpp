// SPDX-License-Identifier: Apache-2.0
// Two-pass depth peeling. For each layer, the first pass finds the key of the next fragment without
// shading; the second shades only the fragment with this key. So every kept fragment is shaded
// exactly once.
#include <array>

#include "core/capture/method.h"
#include "core/peel/composite_targets.h"
#include "shaders/interface.glsl"

namespace peeler {
namespace {

class TwoPass final : public LayerMethod {
  public:
    bool takesAll() const override { return false; }

    std::uint64_t tileBytes(std::uint64_t tile_pixels,
                            const CaptureSettings& settings) const override {
        return LayerTargets::bytes(tile_pixels, settings);
    }

    int capture(SceneRasterizer& rasterizer, const LayerArea& area) override {
        layers_.begin(rasterizer, area.window, kNearestFirst);
        return layers_.peelInTwo(rasterizer, area.window, area.layers, [&](int, int side) {
            layers_.store(rasterizer, area.window, side);
        });
    }

  private:
    LayerTargets layers_;
};

/// Ping-pong compositing, for GPUs that cannot blend into float targets. Composites each layer
/// under the layers in front: reads the previous composite from one texture, and writes the new
/// composite to the other.
class TwoPassComposite final : public CompositeMethod {
  public:
    std::uint64_t tileBytes(std::uint64_t tile_pixels,
                            const CaptureSettings& settings) const override {
        return LayerTargets::bytes(tile_pixels, settings) +
               2 * CompositeTargets::bytes(CompositeTargets::kBack, tile_pixels) +
               CompositeTargets::bytes(CompositeTargets::kTail, tile_pixels);
    }

    int composite(SceneRasterizer& rasterizer, const CompositeArea& area) override {
        const auto& gl = rasterizer.functions();
        constexpr auto kBack = CompositeTargets::kBack;
        // Orders the sides so that the last layer ends up in targets_, where the tail is added
        // behind it.
        std::array<CompositeTargets*, 2> sides = {&targets_, &other_};
        if (area.layers % 2 == 0) std::swap(sides[0], sides[1]);
        targets_.begin(rasterizer, area.window, kBack | (area.tail ? CompositeTargets::kTail : 0U));
        other_.begin(rasterizer, area.window, kBack);
        layers_.begin(rasterizer, area.window, kNearestFirst);
        int passes =
            layers_.peelInTwo(rasterizer, area.window, area.layers, [&](int layer, int side) {
                CompositeTargets& to = *sides[static_cast<std::size_t>(layer % 2)];
                const CompositeTargets& from = *sides[static_cast<std::size_t>(1 - layer % 2)];
                gl.BindTextureUnit(PEELER_FRONT_UNIT, from.textures(kBack).front());
                layers_.blend(rasterizer, area.window, side,
                              {.definitions = "PING_PONG",
                               .framebuffer = to.framebuffer(rasterizer, kBack),
                               .argument = {{layer, 0, 0, 0}}});
            });
        if (area.tail) passes += targets_.addTail(rasterizer, area.window, layers_, area.layers);
        targets_.resolve(rasterizer, area.window);
        return passes;
    }

  private:
    LayerTargets layers_;
    CompositeTargets targets_, other_;
};

}  // namespace

std::unique_ptr<LayerMethod> makeTwoPass() {
    return std::make_unique<TwoPass>();
}

std::unique_ptr<CompositeMethod> makeTwoPassComposite() {
    return std::make_unique<TwoPassComposite>();
}

}  // namespace peeler
