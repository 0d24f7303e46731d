// SPDX-License-Identifier: Apache-2.0
// Draws the scene into a raster tile with one of the fragment shaders.
#pragma once

#include <cstdint>
#include <string_view>
#include <vector>

#include "core/capture/gpu_scene.h"
#include "core/capture/pass_context.h"
#include "core/capture/passes.h"
#include "core/gl/context.h"
#include "core/gl/objects.h"

namespace peeler {

namespace shader {
struct FrameRecord;
}

/// Rasterisation is repeatable only if the viewport never changes, so the picture is divided into
/// raster tiles: a fixed grid that depends on its size alone. Inside a tile every pass of every
/// method, band and crop uses the same viewport and merely another scissor; hence they agree bit
/// for bit.
class SceneRasterizer {
  public:
    static constexpr int kTileSize = 4096;

    /// All must outlive it.
    SceneRasterizer(const gl::Context& context, const GpuScene& scene,
                    const PassContext& pass_context);

    /// Takes the pass context as it is now. The view of its lighting is the caller's to set.
    void begin();
    /// The tiles of the view that touch `area`, row by row.
    std::vector<Window> tilesOf(const Window& area) const;
    /// Makes `tile` (one of tilesOf) the target. With Surfaces::kVisible or kTransparent the next
    /// bounded pass renders the opaque bound of the tile first.
    void setTile(const Window& tile);
    /// The band whose buffers the fragments go to, and how many of the nearest layers a composite
    /// shows in order.
    void setBand(const Window& band, std::uint32_t layers = 0);

    /// Draws the scene into `area` (picture coordinates, inside the tile).
    void draw(const GeometryPass& pass, const Window& area);
    /// Runs a fragment shader over `area`.
    void drawFullScreen(const FullScreenPass& pass, const Window& area);
    /// Runs a compute shader over `area`, which is also its argument.
    void compute(std::string_view shader, std::string_view definitions, const Window& area);

    /// Where in the picture the scene's draws may be, whatever the sample position; outside of it
    /// there is no fragment. Takes as long as setTile().
    Window drawnWindow() const;
    const Window& tile() const { return tile_; }
    /// The tile's viewport and `area` as scissor.
    gl::PassState passState(GLuint framebuffer, const Window& area) const;
    /// Whether opaque surfaces hide what is behind them.
    bool bounded() const { return pass_context_.settings.surfaces != Surfaces::kAll; }
    HitMode hitMode() const { return pass_context_.settings.hit_mode; }
    bool floatColor() const { return pass_context_.settings.color_type == PixelType::kFloat; }
    /// Whether opacity is coloured.
    bool tinted() const { return pass_context_.settings.tinted; }
    const gl::Functions& functions() const { return context_.functions(); }
    /// Bytes of textures a tile needs for the opaque bound.
    std::uint64_t boundBytes(std::uint64_t tile_pixels) const;
    /// Frees them. The next bounded pass renders the bound anew.
    void freeBound();

  private:
    /// Binds the record of view, tile and band, and the sampler of the peels' textures.
    void bindFrame();
    /// To the clip space of the tile.
    glm::dmat4 clipFromView() const;
    void fillClip(shader::FrameRecord& record) const;
    bool shown(const GeometryPass& pass, const Draw& draw) const;
    /// `area` relative to the tile, y up: x0, y0, x1, y1.
    Window inTile(const Window& area) const;
    void uploadDrawRecords();
    Window grown(const Window& bounds, const Draw& draw) const;
    /// Makes the buffer at least that large; what it held is lost.
    void reserve(gl::Buffer& buffer, std::size_t bytes) const;
    void submit(const Draw& draw) const;
    void renderOpaqueBound();

    const gl::Context& context_;
    const GpuScene& scene_;
    const PassContext& pass_context_;
    gl::Buffer frame_record_, draw_records_, instance_records_;
    ShaderVariants shaders_;
    std::vector<Window> screen_bounds_;  // of the draws, in the tile, y up
    std::vector<int> boundary_nodes_;    // of the clip volume, sorted
    Window tile_, band_;
    std::uint32_t layers_ = 0;
    bool frame_dirty_ = true, bound_missing_ = false;
    gl::Texture bound_depth_, bound_primitive_;
    gl::Framebuffer bound_framebuffer_;
    Window bound_size_;
    gl::SamplerObject nearest_;
    gl::VertexArray no_vertices_;
};

}  // namespace peeler
