// SPDX-License-Identifier: Apache-2.0
// The ping-ponged render targets for peeling one layer at a time.
#pragma once

#include <array>
#include <cstdint>
#include <functional>
#include <string_view>

#include "core/capture/method.h"
#include "core/capture/scene_rasterizer.h"
#include "core/gl/objects.h"

namespace peeler {

/// The end from which layers are peeled.
struct PeelDirection {
    bool nearest_first;
    std::string_view definitions;  ///< for peel_layer.frag
    gl::DepthTest depth_test;      ///< selects the next fragment beyond the previous layer
    float first_depth;             ///< the key before any layer
    GLuint first_primitive;
    float empty_depth;  ///< of pixels without the layer; with primitive 0, nothing lies beyond
};

/// From the front. The first key is in front of everything: the near plane has depth 1, and keys
/// start at 1.
inline constexpr PeelDirection kNearestFirst = {true, "", gl::DepthTest::kNearest, 1, 0, 0};
/// From behind. The first key is behind everything: no fragment has depth 0. A pixel without the
/// layer gets the key (1, 0), which nothing lies in front of, so the pixel stays finished.
inline constexpr PeelDirection kFarthestFirst = {false, "BACKWARD",  gl::DepthTest::kFarthest,
                                                 0,     0xFFFFFFFFU, 1};

/// Two pairs of (depth, primitive) textures of raster tile size. The current layer is rendered into
/// one pair while the previous layer is read from the other. Both pairs share one colour texture.
class LayerTargets {
  public:
    /// A callback that consumes a layer, whose key is in `side` and whose colour is in the colour
    /// texture.
    using Take = std::function<void(int layer, int side)>;

    enum Attachments { kKey, kKeyAndColor, kColor };

    /// Bytes of all textures.
    static std::uint64_t bytes(std::uint64_t tile_pixels, const CaptureSettings& settings);

    /// Prepares for peeling in this direction: (re)allocates for the rasterizer's tile, and sets
    /// the key that precedes the first layer.
    void begin(const SceneRasterizer& rasterizer, const Window& area,
               const PeelDirection& direction);
    /// Prepares like begin(), but marks every pixel finished; the caller's next pass into
    /// framebuffer(1, kKey) opens the pixels to be peeled.
    void beginFinished(const SceneRasterizer& rasterizer, const Window& area);

    /// Peels `layers` layers of `area`, one geometry pass each. Returns the passes.
    int peel(SceneRasterizer& rasterizer, const Window& area, std::uint32_t layers,
             const PeelDirection& direction, const Take& take);
    /// Peels from the front with two geometry passes per layer: the first finds the key without
    /// shading, the second shades only the fragment with that key.
    int peelInTwo(SceneRasterizer& rasterizer, const Window& area, std::uint32_t layers,
                  const Take& take);

    GLuint framebuffer(int i, Attachments attachments) const;
    /// Binds side `i` as the previous layer for the shaders.
    void bindForReading(const gl::Functions& gl, int i) const;
    /// Returns the side that holds the last of `layers` layers.
    static int sideOf(std::uint32_t layers) { return static_cast<int>((layers + 1) % 2); }

    /// Appends the layer of side `i` to the lists of the band: one fragment for every pixel of
    /// `area` that has the layer.
    void store(SceneRasterizer& rasterizer, const Window& area, int i) const;
    /// Runs blend_layer.frag on the layer of side `i`. `pass` is complete except for its shader.
    void blend(SceneRasterizer& rasterizer, const Window& area, int i, FullScreenPass pass) const;

  private:
    void allocate(const SceneRasterizer& rasterizer);
    /// Sets the key of side `i` in `area`. For store() and blend(), primitive 0 means no fragment.
    void clear(const SceneRasterizer& rasterizer, const Window& area, int i, float depth,
               GLuint primitive) const;

    struct Side {
        gl::Texture depth, primitive;
        gl::Framebuffer key, key_and_color;
    };
    std::array<Side, 2> sides_;
    gl::Texture color_, opacity_;  ///< opacity_ only for coloured opacity
    gl::Framebuffer color_only_;
    Window size_;
};

/// Peels and stores layers one by one from either end.
class PeeledLayers final : public LayerMethod {
  public:
    explicit PeeledLayers(const PeelDirection& direction) : direction_(direction) {}

    // From behind, a layer's index from the front is known only after all layers have been peeled,
    // so the lists are sorted afterwards.
    bool takesAll() const override { return !direction_.nearest_first; }

    std::uint64_t tileBytes(std::uint64_t tile_pixels,
                            const CaptureSettings& settings) const override {
        return LayerTargets::bytes(tile_pixels, settings);
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
