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

/// A direction of peeling: from the front or from behind.
struct PeelDirection {
    bool nearest_first;
    std::string_view definitions;  ///< definitions for peel_layer.frag
    gl::DepthTest depth_test;      ///< selects the next fragment beyond the previous layer
    float first_depth;             ///< depth of the key before the first layer
    GLuint first_primitive;
    float empty_depth;  ///< depth that marks a pixel without the layer; the pixel's primitive is 0
};

/// Peeling from the front. The key before the first layer is in front of all fragments: the near
/// plane has depth 1, and fragments' keys start at 1.
inline constexpr PeelDirection kNearestFirst = {true, "", gl::DepthTest::kNearest, 1, 0, 0};
/// Peeling from behind. The key before the first layer is behind all fragments, since no fragment
/// has depth 0. A pixel without the layer gets the key (1, 0). No fragment is in front of this key,
/// so the pixel stays finished.
inline constexpr PeelDirection kFarthestFirst = {false, "BACKWARD",  gl::DepthTest::kFarthest,
                                                 0,     0xFFFFFFFFU, 1};

/// Two pairs of (depth, primitive) textures of raster tile size. The current layer is rendered into
/// one pair while the previous layer is read from the other. Both pairs share one colour texture.
class LayerTargets {
  public:
    /// A callback that consumes a layer. The layer's key is in `side`, its colour in the colour
    /// texture.
    using Take = std::function<void(int layer, int side)>;

    enum Attachments { kKey, kKeyAndColor, kColor };

    static std::uint64_t bytes(std::uint64_t tile_pixels, const CaptureSettings& settings);

    /// Prepares for peeling in this direction: allocates textures of the rasterizer's tile size if
    /// necessary, and sets the key before the first layer.
    void begin(const SceneRasterizer& rasterizer, const Window& area,
               const PeelDirection& direction);
    /// Prepares like begin(), but marks every pixel as finished. The caller's next pass into
    /// framebuffer(1, kKey) must reopen the pixels to peel.
    void beginFinished(const SceneRasterizer& rasterizer, const Window& area);

    /// Peels `layers` layers of `area`, one geometry pass each. Returns the number of passes.
    int peel(SceneRasterizer& rasterizer, const Window& area, std::uint32_t layers,
             const PeelDirection& direction, const Take& take);
    /// Peels from the front with two geometry passes per layer. The first finds the key without
    /// shading; the second shades only the fragment with this key.
    int peelInTwo(SceneRasterizer& rasterizer, const Window& area, std::uint32_t layers,
                  const Take& take);

    GLuint framebuffer(int i, Attachments attachments) const;
    /// Binds the key of side `i` as the previous layer that shaders read.
    void bindForReading(const gl::Functions& gl, int i) const;
    /// Returns the side that holds the last of `layers` layers.
    static int sideOf(std::uint32_t layers) { return static_cast<int>((layers + 1) % 2); }

    /// Appends the layer of side `i` to the band's lists: one fragment for every pixel of `area`
    /// that has this layer.
    void store(SceneRasterizer& rasterizer, const Window& area, int i) const;
    /// Runs blend_layer.frag on the layer of side `i`. `pass` must have everything except its
    /// shader.
    void blend(SceneRasterizer& rasterizer, const Window& area, int i, FullScreenPass pass) const;

  private:
    void allocate(const SceneRasterizer& rasterizer);
    /// Sets the key of side `i` in `area`. store() and blend() treat primitive 0 as no fragment.
    void clear(const SceneRasterizer& rasterizer, const Window& area, int i, float depth,
               GLuint primitive) const;

    struct Side {
        gl::Texture depth, primitive;
        gl::Framebuffer key, key_and_color;
    };
    std::array<Side, 2> sides_;
    gl::Texture color_, opacity_;  ///< opacity_ exists only if opacity is coloured
    gl::Framebuffer color_only_;
    Window size_;
};

/// A method that peels layers from either end and stores them one by one.
class PeeledLayers final : public LayerMethod {
  public:
    explicit PeeledLayers(const PeelDirection& direction) : direction_(direction) {}

    // Peeling from behind gives layers whose index from the front is unknown until all layers are
    // peeled. So the lists are sorted afterwards.
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
