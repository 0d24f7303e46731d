// SPDX-License-Identifier: Apache-2.0
// The render targets that peel one layer at a time: ping-ponged keys, and a colour.
#pragma once

#include <array>
#include <cstdint>
#include <functional>
#include <string_view>

#include "core/capture/method.h"
#include "core/capture/scene_rasterizer.h"
#include "core/gl/objects.h"

namespace peeler {

/// From which end layers are peeled.
struct PeelDirection {
    bool nearest_first;
    std::string_view definitions;  ///< of peel_layer.frag
    gl::DepthTest depth_test;      ///< which of the fragments beyond the previous layer is next
    float first_depth;             ///< the key before any layer
    GLuint first_primitive;
    float empty_depth;  ///< of a pixel without the layer; with primitive 0 nothing is beyond it
};

/// Before any layer, in front of everything: the near plane has depth 1, and keys start at 1.
inline constexpr PeelDirection kNearestFirst = {true, "", gl::DepthTest::kNearest, 1, 0, 0};
/// Before any layer, behind everything: no fragment has depth 0. In front of the key (1, 0) of a
/// pixel without the layer there is nothing: it stays finished.
inline constexpr PeelDirection kFarthestFirst = {false, "BACKWARD",  gl::DepthTest::kFarthest,
                                                 0,     0xFFFFFFFFU, 1};

/// Two sides of (depth, primitive) textures as large as a raster tile: the layer being peeled is
/// rendered into one while the previous layer is read from the other. One colour texture serves
/// both.
class LayerTargets {
  public:
    /// What is done with each layer, `side` and the colour holding it.
    using Take = std::function<void(int layer, int side)>;

    enum Attachments { kKey, kKeyAndColor, kColor };

    /// Bytes of all textures.
    static std::uint64_t bytes(std::uint64_t tile_pixels, const CaptureSettings& settings);

    /// Gets ready to peel from this end: (re)allocates for the rasterizer's tile, and sets the key
    /// before the first layer.
    void begin(const SceneRasterizer& rasterizer, const Window& area,
               const PeelDirection& direction);
    /// Likewise, but finishes every pixel; the caller's next pass into framebuffer(1, kKey) opens
    /// the pixels to be peeled.
    void beginFinished(const SceneRasterizer& rasterizer, const Window& area);

    /// Peels `layers` layers of `area`, one geometry pass each; returns the passes.
    int peel(SceneRasterizer& rasterizer, const Window& area, std::uint32_t layers,
             const PeelDirection& direction, const Take& take);
    /// The same from the front with two geometry passes each: the first finds the key and shades
    /// nothing, the second shades the one fragment that has it.
    int peelInTwo(SceneRasterizer& rasterizer, const Window& area, std::uint32_t layers,
                  const Take& take);

    GLuint framebuffer(int i, Attachments attachments) const;
    /// Makes side `i` what the shaders read as the previous layer.
    void bindForReading(const gl::Functions& gl, int i) const;
    /// The side that holds the last of so many layers.
    static int sideOf(std::uint32_t layers) { return static_cast<int>((layers + 1) % 2); }

    /// Appends the layer of side `i` to the lists of the band: one fragment of every pixel of
    /// `area` that has one.
    void store(SceneRasterizer& rasterizer, const Window& area, int i) const;
    /// Runs blend_layer.frag on the layer of side `i`. The pass needs everything but its shader.
    void blend(SceneRasterizer& rasterizer, const Window& area, int i, FullScreenPass pass) const;

  private:
    void allocate(const SceneRasterizer& rasterizer);
    /// Sets the key of side `i` in `area`. Primitive 0 means to store() and blend(): no fragment.
    void clear(const SceneRasterizer& rasterizer, const Window& area, int i, float depth,
               GLuint primitive) const;

    struct Side {
        gl::Texture depth, primitive;
        gl::Framebuffer key, key_and_color;
    };
    std::array<Side, 2> sides_;
    gl::Texture color_, opacity_;  ///< the second where opacity is coloured
    gl::Framebuffer color_only_;
    Window size_;
};

/// Layers peeled one after the other from either end, and stored.
class PeeledLayers final : public LayerMethod {
  public:
    explicit PeeledLayers(const PeelDirection& direction) : direction_(direction) {}

    // From behind, a layer's index from the front is known only when all have been peeled, so the
    // lists are put in order afterwards.
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
