// SPDX-License-Identifier: Apache-2.0
// Dual depth peeling (Bavoil & Myers, "Order Independent Transparency with Dual Depth Peeling",
// NVIDIA 2008): front and back at once, from the nearest and farthest depth in a two-channel target
// with MAX blending.
#include <array>

#include "core/peel/method.h"
#include "core/scene_rasterizer.h"
#include "shaders/interface.glsl"

namespace peeler {
namespace {

class Dual final : public PeelMethod {
  public:
    bool takesAll() const override { return true; }

    std::uint64_t tileBytes(std::uint64_t tile_pixels, bool) const override {
        return tile_pixels * 2 * 2 * sizeof(float);
    }

    int capture(SceneRasterizer& rasterizer, const Window& area, std::uint32_t layers) override {
        allocate(rasterizer);
        draw(rasterizer, area, 0, "dual_range.frag", false);
        // Each pass takes a layer from the front and one from the back; coincident ones go
        // together.
        const int passes = static_cast<int>((layers + 1) / 2);
        for (int pass = 1; pass <= passes; ++pass) {
            rasterizer.functions().BindTextureUnit(PEELER_PREVIOUS_DEPTH_UNIT,
                                                   sides_[1 - pass % 2].range.name());
            draw(rasterizer, area, pass % 2, "dual_peel.frag", true);
        }
        return passes + 1;
    }

  private:
    struct Side {
        gl::Texture range;  ///< (nearest depth, minus farthest depth)
        gl::Framebuffer framebuffer;
    };

    void allocate(const SceneRasterizer& rasterizer) {
        const auto& gl = rasterizer.functions();
        const Window size{0, 0, rasterizer.tile().width(), rasterizer.tile().height()};
        if (size == size_) return;
        sides_ = {};
        for (auto& side : sides_) {
            side.range = gl::makeTexture2D(gl, GL_RG32F, size.x1, size.y1);
            side.framebuffer = gl::makeFramebuffer(gl, {side.range.name()}, 0);
        }
        size_ = size;
    }

    void draw(SceneRasterizer& rasterizer, const Window& area, int side, const char* shader,
              bool shades) const {
        const GLuint framebuffer = sides_[static_cast<std::size_t>(side)].framebuffer.name();
        const auto& gl = rasterizer.functions();
        gl::apply(gl, rasterizer.passState(framebuffer, area));
        // An empty range: nearer than nothing, and no depth lies between.
        const std::array<float, 4> empty = {-1, -2, 0, 0};
        gl.ClearNamedFramebufferfv(framebuffer, GL_COLOR, 0, empty.data());
        rasterizer.draw({.fragment_shader = shader,
                         .shades = shades,
                         .framebuffer = framebuffer,
                         .max_blending = true},
                        area);
    }

    std::array<Side, 2> sides_;
    Window size_;
};

}  // namespace

std::unique_ptr<PeelMethod> makeDual() {
    return std::make_unique<Dual>();
}

}  // namespace peeler
