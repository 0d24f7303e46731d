// SPDX-License-Identifier: Apache-2.0
// The render targets in which a composite comes about, and the passes that methods share.
#pragma once

#include <array>
#include <cstdint>
#include <map>
#include <vector>

#include "core/capture/method.h"
#include "core/gl/objects.h"
#include "core/peel/layer_targets.h"

namespace peeler {

/// Textures as large as a raster tile, 32-bit float. What is peeled from the front goes under
/// `front`, what is peeled from behind over `back`, and what has no order is summed up in `tail`.
class CompositeTargets {
  public:
    enum Part : unsigned {
        kFront = 1,  ///< RGBA, premultiplied
        kBack = 2,   ///< RGBA, premultiplied
        kTail = 4,   ///< RGBA sum of premultiplied colours, and the number of fragments
        // Of each channel, where opacity is coloured.
        kBackOpacity = 8,
        kTailOpacity = 16
    };
    static std::uint64_t bytes(unsigned parts, std::uint64_t tile_pixels);

    /// `parts`, with their opacities if opacity is coloured.
    static unsigned withOpacity(unsigned parts, bool tinted);

    /// (Re)allocates for the rasterizer's tile and empties `area`.
    void begin(SceneRasterizer& rasterizer, const Window& area, unsigned parts);

    /// The parts as attachments, in the order above (the tail's sum before its count).
    GLuint framebuffer(const SceneRasterizer& rasterizer, unsigned parts);
    std::vector<GLuint> textures(unsigned parts) const;
    /// How each of those attachments is blended; those after `first` others that are not.
    static std::array<gl::Blend, gl::kMaxAttachments> blending(unsigned parts,
                                                               std::size_t first = 0);

    /// Sums up what lies behind the last of so many layers: one geometry pass.
    int addTail(SceneRasterizer& rasterizer, const Window& area, const LayerTargets& layers,
                std::uint32_t last);
    /// Sums up all fragments, or with an opaque bound those in front of it: one geometry pass.
    int addFragments(SceneRasterizer& rasterizer, const Window& area);
    /// Blends the same fragments over the back in draw order: one geometry pass, or two where
    /// opacity is coloured.
    int blendUnsorted(SceneRasterizer& rasterizer, const Window& area);
    /// With Surfaces::kVisible, puts the nearest opaque surface into the back: as many, or none.
    int addOpaque(SceneRasterizer& rasterizer, const Window& area);
    /// Blends a texture of premultiplied colours over the back.
    void blendOverBack(SceneRasterizer& rasterizer, const Window& area, GLuint texture);

    /// Writes colours of the band: front, then back, then the average of the tail; `definitions`
    /// (TAIL_FIRST, WEIGHTED_SUM) change that.
    void resolve(SceneRasterizer& rasterizer, const Window& area, const char* definitions = "");

  private:
    int drawUnsorted(SceneRasterizer& rasterizer, const Window& area, Draws draws, bool blended);

    gl::Texture front_, back_, tail_sum_, tail_count_, back_opacity_, tail_opacity_;
    std::map<unsigned, gl::Framebuffer> framebuffers_;
    unsigned parts_ = 0;
    Window size_;
};

/// Front to back: peels `area.layers` layers and blends each under the front, then the tail.
/// begin() of both is the caller's, so that pixels may be left out. Returns the geometry passes.
int compositeNearestFirst(SceneRasterizer& rasterizer, const CompositeArea& area,
                          LayerTargets& layers, CompositeTargets& targets);

/// What methods share that composite all fragments at once, in no order: the nearest opaque
/// surface, if only the visible is shown; then one geometry pass of all fragments, or of those in
/// front of it; then a formula.
class Unordered final : public CompositeMethod {
  public:
    using Pass = int (CompositeTargets::*)(SceneRasterizer&, const Window&);

    /// `parts` are the targets, `formula` the definitions of resolve.comp.
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
