// SPDX-License-Identifier: Apache-2.0
// The render targets of composites, and the passes that methods share.
#pragma once

#include <array>
#include <cstdint>
#include <map>
#include <vector>

#include "core/capture/method.h"
#include "core/gl/objects.h"
#include "core/peel/layer_targets.h"

namespace peeler {

/// 32-bit float textures of raster tile size. Layers peeled from the front go under `front`, layers
/// peeled from behind over `back`; unordered fragments are summed in `tail`.
class CompositeTargets {
  public:
    enum Part : unsigned {
        kFront = 1,  ///< RGBA, premultiplied
        kBack = 2,   ///< RGBA, premultiplied
        kTail = 4,   ///< RGBA sum of premultiplied colours, and the fragment count
        // Per channel, for coloured opacity.
        kBackOpacity = 8,
        kTailOpacity = 16
    };
    static std::uint64_t bytes(unsigned parts, std::uint64_t tile_pixels);

    /// Adds the opacities to `parts` if opacity is coloured.
    static unsigned withOpacity(unsigned parts, bool tinted);

    /// (Re)allocates for the rasterizer's tile and clears `area`.
    void begin(SceneRasterizer& rasterizer, const Window& area, unsigned parts);

    /// Returns a framebuffer of the parts, in the order above (the tail's sum before its count).
    GLuint framebuffer(const SceneRasterizer& rasterizer, unsigned parts);
    std::vector<GLuint> textures(unsigned parts) const;
    /// Returns the blend modes for a framebuffer with these parts after `first` other attachments,
    /// which are not blended.
    static std::array<gl::Blend, gl::kMaxAttachments> blending(unsigned parts,
                                                               std::size_t first = 0);

    /// Sums all fragments behind the first `last` layers: one geometry pass.
    int addTail(SceneRasterizer& rasterizer, const Window& area, const LayerTargets& layers,
                std::uint32_t last);
    /// Sums all fragments or, with an opaque bound, those in front of the bound: one geometry pass.
    int addFragments(SceneRasterizer& rasterizer, const Window& area);
    /// Blends over the back, in draw order, the fragments that addFragments() would sum: one
    /// geometry pass, or two for coloured opacity.
    int blendUnsorted(SceneRasterizer& rasterizer, const Window& area);
    /// With Surfaces::kVisible, draws the nearest opaque surface into the back. Returns the number
    /// of geometry passes, 0 for other settings.
    int addOpaque(SceneRasterizer& rasterizer, const Window& area);
    /// Blends a texture of premultiplied colours over the back.
    void blendOverBack(SceneRasterizer& rasterizer, const Window& area, GLuint texture);

    /// Writes the band's colours: front over back over the tail's average. `definitions`
    /// (TAIL_FIRST, WEIGHTED_SUM) change the formula.
    void resolve(SceneRasterizer& rasterizer, const Window& area, const char* definitions = "");

  private:
    int drawUnsorted(SceneRasterizer& rasterizer, const Window& area, Draws draws, bool blended);

    gl::Texture front_, back_, tail_sum_, tail_count_, back_opacity_, tail_opacity_;
    std::map<unsigned, gl::Framebuffer> framebuffers_;
    unsigned parts_ = 0;
    Window size_;
};

/// Peels `area.layers` layers front to back, blends each under the front, then adds the tail. The
/// caller must first call begin() of `layers` and of `targets`, which lets it exclude pixels.
/// Returns the geometry passes.
int compositeNearestFirst(SceneRasterizer& rasterizer, const CompositeArea& area,
                          LayerTargets& layers, CompositeTargets& targets);

/// A method that composites all fragments at once, without order: with Surfaces::kVisible the
/// nearest opaque surface; then one geometry pass of all fragments, or of those in front of it;
/// then a formula.
class Unordered final : public CompositeMethod {
  public:
    using Pass = int (CompositeTargets::*)(SceneRasterizer&, const Window&);

    /// `parts` are the targets that are drawn into, `formula` the definitions for resolve.comp.
    Unordered(unsigned parts, Pass pass, const char* formula)
        : parts_(parts), pass_(pass), formula_(formula) {}

    std::uint64_t tileBytes(std::uint64_t tile_pixels,
                            const CaptureSettings& settings) const override {
        return CompositeTargets::bytes(CompositeTargets::withOpacity(parts_, settings.tinted),
                                       tile_pixels);
    }

    int composite(SceneRasterizer& rasterizer, const CompositeArea& area) override {
        targets_.begin(rasterizer, area.window,
                       CompositeTargets::withOpacity(parts_, rasterizer.tinted()));
        int passes = targets_.addOpaque(rasterizer, area.window);
        passes += (targets_.*pass_)(rasterizer, area.window);
        targets_.resolve(rasterizer, area.window, formula_);
        return passes;
    }

  private:
    unsigned parts_;
    Pass pass_;
    const char* formula_;
    CompositeTargets targets_;
};

}  // namespace peeler
