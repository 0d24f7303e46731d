// SPDX-License-Identifier: Apache-2.0
// Front-to-back depth peeling (Everitt, "Interactive Order-Independent Transparency", 2001), with
// the key (depth, primitive) in place of depth alone: coincident fragments are peeled one after the
// other.
#include <array>

#include "core/peel/method.h"
#include "core/scene_rasterizer.h"
#include "shaders/interface.glsl"

namespace peeler {
namespace {

class FrontToBack final : public PeelMethod {
  public:
    bool takesAll() const override { return false; }

    std::uint64_t tileBytes(std::uint64_t tile_pixels, bool float_color) const override {
        constexpr std::uint64_t kKeys = 2 * (sizeof(float) + sizeof(std::uint32_t));
        return tile_pixels * (kKeys + (float_color ? 16 : 8));
    }

    int capture(SceneRasterizer& rasterizer, const Window& area, std::uint32_t layers) override {
        const auto& gl = rasterizer.functions();
        allocate(rasterizer);
        const std::vector<std::string> definitions = rasterizer.floatColor()
                                                         ? std::vector<std::string>{"COLOR_FLOAT"}
                                                         : std::vector<std::string>{};
        const auto& store = rasterizer.program({"store_layer.comp"}, definitions);
        const Window inside = rasterizer.inTile(area);

        // In front of everything: the near plane has depth 1, and keys start at 1.
        clear(rasterizer, area, sides_[1].framebuffer.name(), 1, 0);
        for (std::uint32_t layer = 0; layer < layers; ++layer) {
            const Side& previous = sides_[(layer + 1) % 2];
            const Side& current = sides_[layer % 2];
            clear(rasterizer, area, current.framebuffer.name(), 0, 0);
            bind(gl, previous);
            rasterizer.draw({.fragment_shader = "front_to_back.frag",
                             .shades = true,
                             .framebuffer = current.framebuffer.name(),
                             .depth_test = true},
                            area);
            bind(gl, current);
            gl.BindTextureUnit(PEELER_PREVIOUS_COLOR_UNIT, color_.name());
            rasterizer.bindFrame();
            store.use();
            store.set(0, inside.x0, inside.y0, inside.x1, inside.y1);
            gl.DispatchCompute(static_cast<GLuint>(inside.width() + 15) / 16,
                               static_cast<GLuint>(inside.height() + 15) / 16, 1);
            gl.MemoryBarrier(GL_SHADER_STORAGE_BARRIER_BIT);
        }
        return static_cast<int>(layers);
    }

  private:
    struct Side {
        gl::Texture depth, primitive;
        gl::Framebuffer framebuffer;
    };

    void allocate(const SceneRasterizer& rasterizer) {
        const auto& gl = rasterizer.functions();
        const Window size{0, 0, rasterizer.tile().width(), rasterizer.tile().height()};
        if (size == size_) return;
        color_ = {};
        sides_ = {};
        color_ = gl::makeTexture2D(gl, rasterizer.floatColor() ? GL_RGBA32UI : GL_RG32UI, size.x1,
                                   size.y1);
        for (auto& side : sides_) {
            side.depth = gl::makeTexture2D(gl, GL_DEPTH_COMPONENT32F, size.x1, size.y1);
            side.primitive = gl::makeTexture2D(gl, GL_R32UI, size.x1, size.y1);
            side.framebuffer =
                gl::makeFramebuffer(gl, {side.primitive.name(), color_.name()}, side.depth.name());
        }
        size_ = size;
    }

    /// Clears within `area`: a clear heeds the scissor and the depth mask.
    static void clear(const SceneRasterizer& rasterizer, const Window& area, GLuint framebuffer,
                      float depth, GLuint primitive) {
        const auto& gl = rasterizer.functions();
        const Window inside = rasterizer.inTile(area);
        gl::apply(gl, {.framebuffer = framebuffer,
                       .viewport_width = rasterizer.tile().width(),
                       .viewport_height = rasterizer.tile().height(),
                       .scissor_x = inside.x0,
                       .scissor_y = inside.y0,
                       .scissor_width = inside.width(),
                       .scissor_height = inside.height(),
                       .depth_test = true});
        const std::array<GLuint, 4> key = {primitive, 0, 0, 0};
        gl.ClearNamedFramebufferfv(framebuffer, GL_DEPTH, 0, &depth);
        gl.ClearNamedFramebufferuiv(framebuffer, GL_COLOR, 0, key.data());
    }

    static void bind(const gl::Functions& gl, const Side& side) {
        gl.BindTextureUnit(PEELER_PREVIOUS_DEPTH_UNIT, side.depth.name());
        gl.BindTextureUnit(PEELER_PREVIOUS_PRIMITIVE_UNIT, side.primitive.name());
    }

    std::array<Side, 2> sides_;
    gl::Texture color_;
    Window size_;
};

}  // namespace

std::unique_ptr<PeelMethod> makeFrontToBack() {
    return std::make_unique<FrontToBack>();
}

}  // namespace peeler
