// SPDX-License-Identifier: Apache-2.0
// Dual depth peeling (Bavoil & Myers, "Order Independent Transparency with Dual Depth Peeling",
// NVIDIA 2008). Each pass peels from the front and from the back. A two-channel target with MAX
// blending holds the nearest and the farthest depth.
#include <array>
#include <string_view>

#include "core/capture/method.h"
#include "core/capture/scene_rasterizer.h"
#include "core/peel/composite_targets.h"
#include "shaders/interface.glsl"

namespace peeler {
namespace {

using gl::Blend;

/// Ping-pong textures: one side is read while the other is written.
class PingPong {
  public:
    static constexpr std::uint64_t kRangeBytes = 4 * sizeof(float);

    void allocate(const SceneRasterizer& rasterizer, GLenum format) {
        const Window size{0, 0, rasterizer.tile().width(), rasterizer.tile().height()};
        if (size == size_) return;
        sides_ = {};
        for (auto& side : sides_)
            side = gl::makeTexture2D(rasterizer.functions(), format, size.x1, size.y1);
        size_ = size;
    }
    GLuint side(int pass) const { return sides_[static_cast<std::size_t>(pass % 2)].name(); }

  private:
    std::array<gl::Texture, 2> sides_;
    Window size_;
};

/// Clears attachment 0 (the depth range) to an empty range, which any depth replaces, and the other
/// attachments to 0.
void clearAttachments(SceneRasterizer& rasterizer, const Window& area, GLuint framebuffer,
                      int first, int attachments) {
    const auto& gl = rasterizer.functions();
    gl::apply(gl, rasterizer.passState(framebuffer, area));
    constexpr std::array<float, 4> kEmptyRange = {-1, -2, 0, 0}, kNothing = {};
    for (int i = first; i < attachments; ++i)
        gl.ClearNamedFramebufferfv(framebuffer, GL_COLOR, i,
                                   i == 0 ? kEmptyRange.data() : kNothing.data());
}

/// Draws the initial pass, which finds the nearest and the farthest depth of every pixel.
void drawFirstRange(SceneRasterizer& rasterizer, const Window& area, GLuint texture) {
    const auto framebuffer = gl::makeFramebuffer(rasterizer.functions(), {texture}, 0);
    clearAttachments(rasterizer, area, framebuffer.name(), 0, 1);
    rasterizer.draw({.fragment_shader = "dual_range.frag",
                     .framebuffer = framebuffer.name(),
                     .blend = {Blend::kMax}},
                    area);
}

class Dual final : public LayerMethod {
  public:
    bool takesAll() const override { return true; }

    std::uint64_t tileBytes(std::uint64_t tile_pixels, const CaptureSettings&) const override {
        return tile_pixels * PingPong::kRangeBytes;
    }

    int capture(SceneRasterizer& rasterizer, const LayerArea& request) override {
        const Window& area = request.window;
        const auto& gl = rasterizer.functions();
        ranges_.allocate(rasterizer, GL_RG32F);
        drawFirstRange(rasterizer, area, ranges_.side(0));
        // Each pass peels one layer from the front and one from the back. Coincident fragments are
        // peeled together.
        const int passes = static_cast<int>((request.layers + 1) / 2);
        for (int pass = 1; pass <= passes; ++pass) {
            const auto framebuffer = gl::makeFramebuffer(gl, {ranges_.side(pass)}, 0);
            clearAttachments(rasterizer, area, framebuffer.name(), 0, 1);
            gl.BindTextureUnit(PEELER_PREVIOUS_DEPTH_UNIT, ranges_.side(pass - 1));
            rasterizer.draw({.fragment_shader = "dual_peel.frag",
                             .shades = true,
                             .framebuffer = framebuffer.name(),
                             .blend = {Blend::kMax}},
                            area);
            gl.MemoryBarrier(GL_SHADER_STORAGE_BARRIER_BIT);
        }
        return passes + 1;
    }

  private:
    PingPong ranges_;
};

/// The base of the two variants that composite during peeling. Where fragments coincide at a peeled
/// depth, the composite lacks fragments. These pixels are peeled again from the front, by keys that
/// distinguish coincident fragments.
class DualComposite : public CompositeMethod {
  public:
    std::uint64_t tileBytes(std::uint64_t tile_pixels,
                            const CaptureSettings& settings) const override {
        return tile_pixels * PingPong::kRangeBytes + LayerTargets::bytes(tile_pixels, settings) +
               CompositeTargets::bytes(kParts | CompositeTargets::kTail, tile_pixels);
    }

    int composite(SceneRasterizer& rasterizer, const CompositeArea& area) override {
        parts_ = kParts | (area.tail ? CompositeTargets::kTail : 0U);
        targets_.begin(rasterizer, area.window, parts_);
        ranges_.allocate(rasterizer, GL_RG32F);
        drawFirstRange(rasterizer, area.window, ranges_.side(0));
        begin(rasterizer, area.window);
        // After `all` passes, every layer is peeled, since each pass peels the nearest and the
        // farthest layer left. With a limit and no tail, area.layers passes are enough, since they
        // peel this number of layers from the front.
        const std::uint32_t all = (area.deepest + 1) / 2;
        const int passes = static_cast<int>(area.tail ? all : std::min(area.layers, all));
        for (int pass = 1; pass <= passes; ++pass) {
            rasterizer.functions().BindTextureUnit(PEELER_PREVIOUS_DEPTH_UNIT,
                                                   ranges_.side(pass - 1));
            peel(rasterizer, area.window, pass);
        }
        end(rasterizer, area.window, passes);
        const int more = finishShort(rasterizer, area);
        targets_.resolve(rasterizer, area.window);
        return passes + 1 + more;
    }

  protected:
    static constexpr unsigned kParts = CompositeTargets::kFront | CompositeTargets::kBack;

    virtual void begin(SceneRasterizer&, const Window&) {}
    virtual void peel(SceneRasterizer& rasterizer, const Window& area, int pass) = 0;
    virtual void end(SceneRasterizer&, const Window&, int /*passes*/) {}

    /// Draws into the targets: range, front, back and, if there is a tail, its sums.
    void draw(SceneRasterizer& rasterizer, const Window& area, int pass, GLuint framebuffer,
              std::string_view definitions,
              const std::array<Blend, gl::kMaxAttachments>& blend) const {
        rasterizer.draw({.fragment_shader = "dual_composite.frag",
                         .definitions = definitions,
                         .shades = true,
                         .framebuffer = framebuffer,
                         .blend = blend,
                         .argument = {{pass, 0, 0, 0}}},
                        area);
        rasterizer.functions().MemoryBarrier(GL_SHADER_STORAGE_BARRIER_BIT);
    }
    bool hasTail() const { return (parts_ & CompositeTargets::kTail) != 0; }

    PingPong ranges_;
    CompositeTargets targets_;
    unsigned parts_ = 0;

  private:
    int finishShort(SceneRasterizer& rasterizer, const CompositeArea& area);

    LayerTargets layers_;
};

int DualComposite::finishShort(SceneRasterizer& rasterizer, const CompositeArea& area) {
    CompositeArea again = area;
    again.layers = area.layersMissing();
    if (again.layers == 0) return 0;
    rasterizer.drawFullScreen({.fragment_shader = "reopen_pixels.frag",
                               .definitions = hasTail() ? "TAIL" : "",
                               .framebuffer = targets_.framebuffer(rasterizer, parts_)},
                              area.window);
    // The next pass writes the list heads that the previous pass reads.
    rasterizer.functions().MemoryBarrier(GL_SHADER_STORAGE_BARRIER_BIT);
    layers_.beginFinished(rasterizer, area.window);
    rasterizer.drawFullScreen({.fragment_shader = "reopen_pixels.frag",
                               .definitions = "KEY",
                               .framebuffer = layers_.framebuffer(1, LayerTargets::kKey),
                               .depth_test = gl::DepthTest::kReplace},
                              area.window);
    rasterizer.functions().MemoryBarrier(GL_SHADER_STORAGE_BARRIER_BIT);
    return compositeNearestFirst(rasterizer, again, layers_, targets_);
}

/// The variant that the paper anticipates, with a blend equation for each target. The geometry pass
/// blends front layers under the front composite, and back layers over the back composite.
class IndependentBlending final : public DualComposite {
  protected:
    void peel(SceneRasterizer& rasterizer, const Window& area, int pass) override {
        const auto& gl = rasterizer.functions();
        std::vector<GLuint> textures = targets_.textures(parts_);
        textures.insert(textures.begin(), ranges_.side(pass));
        const auto framebuffer = gl::makeFramebuffer(gl, textures, 0);
        clearAttachments(rasterizer, area, framebuffer.name(), 0, 1);
        auto blend = CompositeTargets::blending(parts_, 1);
        blend[0] = Blend::kMax;
        draw(rasterizer, area, pass, framebuffer.name(), hasTail() ? "TAIL" : "", blend);
    }
};

/// The paper's variant: MAX blending for all targets, since GPUs of 2008 had a single blend
/// equation. Each pass computes the new front composite from the previous one. MAX keeps the new
/// values, because colours are not negative and the front composite never decreases. The back is
/// blended after each pass.
class MaxBlending final : public DualComposite {
  public:
    std::uint64_t tileBytes(std::uint64_t tile_pixels,
                            const CaptureSettings& settings) const override {
        return DualComposite::tileBytes(tile_pixels, settings) +
               3 * CompositeTargets::bytes(CompositeTargets::kBack, tile_pixels);
    }

  protected:
    void begin(SceneRasterizer& rasterizer, const Window& area) override {
        const auto& gl = rasterizer.functions();
        fronts_.allocate(rasterizer, GL_RGBA32F);
        const Window size{0, 0, rasterizer.tile().width(), rasterizer.tile().height()};
        if (size != back_size_) {
            back_ = {};
            back_ = gl::makeTexture2D(gl, GL_RGBA32F, size.x1, size.y1);
            back_size_ = size;
        }
        const auto framebuffer = gl::makeFramebuffer(gl, {ranges_.side(0), fronts_.side(0)}, 0);
        clearAttachments(rasterizer, area, framebuffer.name(), 1, 2);
    }

    void peel(SceneRasterizer& rasterizer, const Window& area, int pass) override {
        const auto& gl = rasterizer.functions();
        std::vector<GLuint> textures = {ranges_.side(pass), fronts_.side(pass), back_.name()};
        if (hasTail()) {
            const auto tail = targets_.textures(CompositeTargets::kTail);
            textures.insert(textures.end(), tail.begin(), tail.end());
        }
        const auto framebuffer = gl::makeFramebuffer(gl, textures, 0);
        clearAttachments(rasterizer, area, framebuffer.name(), 0, 3);
        gl.BindTextureUnit(PEELER_PREVIOUS_COLOR_UNIT, fronts_.side(pass - 1));
        draw(rasterizer, area, pass, framebuffer.name(),
             hasTail() ? "MAX_BLENDING TAIL" : "MAX_BLENDING",
             {Blend::kMax, Blend::kMax, Blend::kMax, Blend::kAdd, Blend::kAdd});
        targets_.blendOverBack(rasterizer, area, back_.name());
    }

    void end(SceneRasterizer& rasterizer, const Window& area, int passes) override {
        targets_.blendOverBack(rasterizer, area, fronts_.side(passes));
    }

  private:
    PingPong fronts_;
    gl::Texture back_;
    Window back_size_;
};

}  // namespace

std::unique_ptr<LayerMethod> makeDual() {
    return std::make_unique<Dual>();
}

std::unique_ptr<CompositeMethod> makeDualComposite() {
    return std::make_unique<IndependentBlending>();
}

std::unique_ptr<CompositeMethod> makeDualMaxComposite() {
    return std::make_unique<MaxBlending>();
}

}  // namespace peeler
