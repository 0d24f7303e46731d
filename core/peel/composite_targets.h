// SPDX-License-Identifier: Apache-2.0
// The render targets of composites, and the passes shared by composite methods.
#pragma once

#include <array>
#include <cstdint>
#include <map>
#include <vector>

#include "core/capture/method.h"
#include "core/gl/objects.h"
#include "core/peel/layer_targets.h"

namespace peeler {

/// 32-bit float textures of raster tile size. Layers peeled from the front are blended under
/// `front`, layers peeled from behind over `back`. Unordered fragments are summed in `tail`.
class CompositeTargets {
  public:
    enum Part : unsigned {
        kFront = 1,  ///< RGBA, premultiplied
        kBack = 2,   ///< RGBA, premultiplied
        kTail = 4,   ///< RGBA sum of premultiplied colours, and the fragment count
        // Opacity per channel, if opacity is coloured.
        kBackOpacity = 8,
        kTailOpacity = 16,
        kCoverage = 32,  ///< exact opacity per channel of all fragments in the tail
        kMoments = 64    ///< moments of absorbance over depth (shaders/moments.glsl)
    };
    static std::uint64_t bytes(unsigned parts, std::uint64_t tile_pixels);

    /// Returns `parts`, plus their opacity parts if opacity is coloured.
    static unsigned withOpacity(unsigned parts, bool tinted);

    /// Allocates textures of the rasterizer's tile size if necessary, and clears `area`.
    void begin(SceneRasterizer& rasterizer, const Window& area, unsigned parts);

    /// Returns a framebuffer that has these parts as attachments, in the order of Part. The tail
    /// has two attachments: its sum, then its count. The moments have two: those of the powers 1 to
    /// 4, then that of the power 0.
    GLuint framebuffer(const SceneRasterizer& rasterizer, unsigned parts);
    std::vector<GLuint> textures(unsigned parts) const;
    /// Returns the blend modes for a framebuffer with these parts. The first `first` attachments
    /// are other targets, which are not blended.
    static std::array<gl::Blend, gl::kMaxAttachments> blending(unsigned parts,
                                                               std::size_t first = 0);

    /// Adds all fragments behind the nearest `last` layers to the tail's sums, in one geometry
    /// pass.
    int addTail(SceneRasterizer& rasterizer, const Window& area, const LayerTargets& layers,
                std::uint32_t last);
    /// Adds all fragments to the tail's sums, in one geometry pass. With an opaque bound, adds only
    /// the fragments in front of it.
    int addFragments(SceneRasterizer& rasterizer, const Window& area);
    /// Like addFragments(), but weights the fragments (weighted_blended.cpp, moment_based.cpp).
    int addDepthWeighted(SceneRasterizer& rasterizer, const Window& area);
    int addMomentWeighted(SceneRasterizer& rasterizer, const Window& area);
    /// Blends over the back, in draw order, the same fragments that addFragments() takes. Needs one
    /// geometry pass, or two if opacity is coloured.
    int blendUnsorted(SceneRasterizer& rasterizer, const Window& area);
    /// With Surfaces::kVisible, draws the nearest opaque surface into the back. Returns the number
    /// of geometry passes; with other settings, does nothing and returns 0.
    int addOpaque(SceneRasterizer& rasterizer, const Window& area);
    /// Blends a texture of premultiplied colours over the back.
    void blendOverBack(SceneRasterizer& rasterizer, const Window& area, GLuint texture);

    /// Writes the band's colours: the front over the back over the tail's average. `definitions`
    /// (TAIL_FIRST, WEIGHTED_SUM) change the formula.
    void resolve(SceneRasterizer& rasterizer, const Window& area, const char* definitions = "");

  private:
    int addWith(SceneRasterizer& rasterizer, const Window& area, GeometryPass pass, unsigned parts);
    int drawUnsorted(SceneRasterizer& rasterizer, const Window& area, Draws draws, bool blended);

    gl::Texture front_, back_, tail_sum_, tail_count_, back_opacity_, tail_opacity_, coverage_,
        moments_, absorbance_;
    std::map<unsigned, gl::Framebuffer> framebuffers_;
    unsigned parts_ = 0;
    Window size_;
};

/// Peels `area.layers` layers front to back, blends each under the front, then adds the tail. The
/// caller must first call begin() of `layers` and of `targets`. The caller may then exclude pixels
/// in both. Returns the number of geometry passes.
int compositeNearestFirst(SceneRasterizer& rasterizer, const CompositeArea& area,
                          LayerTargets& layers, CompositeTargets& targets);

/// A method that composites without order. With Surfaces::kVisible, it first draws the nearest
/// opaque surface. Then one geometry pass takes all fragments, or the fragments in front of this
/// surface, and a formula composites them.
class Unordered final : public CompositeMethod {
  public:
    using Pass = int (CompositeTargets::*)(SceneRasterizer&, const Window&);

    /// `parts`: the targets to draw into; `formula`: the definitions for resolve.comp.
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
