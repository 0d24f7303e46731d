// SPDX-License-Identifier: Apache-2.0
// The scene rasteriser: draws the scene into a raster tile with a given fragment shader.
#pragma once

#include <array>
#include <cstdint>
#include <span>
#include <string_view>
#include <vector>

#include "core/capture/gpu_scene.h"
#include "core/capture/pass_context.h"
#include "core/capture/passes.h"
#include "core/fragments/pixel_places.h"
#include "core/gl/context.h"
#include "core/gl/objects.h"

namespace peeler {

namespace shader {
struct FrameRecord;
}

/// Consecutive hits of one draw.
struct HitGroup {
    std::size_t draw = 0;
    std::uint32_t hits = 0;
};

/// A rasteriser of the scene. Rasterisation is repeatable only with a constant viewport. Therefore
/// the picture is divided into raster tiles, a fixed grid that depends only on the picture's size.
/// All passes in a tile use the same viewport, for every method, band and crop, and differ only in
/// their scissor rectangles. Therefore their results agree bit for bit.
class SceneRasterizer {
  public:
    static constexpr int kTileSize = 4096;

    /// All arguments must outlive this object.
    SceneRasterizer(const gl::Context& context, const GpuScene& scene,
                    const PassContext& pass_context);

    /// Applies the current state of the pass context. The caller must set the view of the lighting.
    void begin();
    /// Returns the tiles of the view that touch `area`, row by row.
    std::vector<Window> tilesOf(const Window& area) const;
    /// Makes `tile` (one of tilesOf()) the target. With Surfaces::kVisible or kTransparent, the
    /// next bounded pass first renders the tile's opaque bound.
    void setTile(const Window& tile);
    /// Sets the band whose buffers receive the fragments, and the number of nearest layers that a
    /// composite orders.
    void setBand(const Window& band, std::uint32_t layers = 0);

    /// Draws the scene into `area` (picture coordinates, inside the tile).
    void draw(const GeometryPass& pass, const Window& area);
    void drawFullScreen(const FullScreenPass& pass, const Window& area);
    /// Runs a compute shader over `area`. Passes the area's corners in the tile as the uniform at
    /// location 0, and `second` as the uniform at location 1.
    void compute(std::string_view shader, std::string_view definitions, const Window& area,
                 const ShaderArgument& second = {});

    /// Shades hits, which must be bound at PEELER_HITS in the order of `groups`, and writes their
    /// colours to PEELER_HIT_COLORS. Needs no tile and no band. `positions`: as for
    /// HitShader::shade().
    void shadeHits(std::span<const HitGroup> groups,
                   const std::array<glm::dvec2, kPixelSamples>* positions);

    /// Returns the window of the picture that can contain fragments, for any sample position. Takes
    /// about as long as setTile().
    Window drawnWindow() const;
    const Window& tile() const { return tile_; }
    /// Returns a state with the tile's viewport and `area` as scissor.
    gl::PassState passState(GLuint framebuffer, const Window& area) const;
    /// Whether opaque surfaces hide the fragments behind them.
    bool bounded() const { return pass_context_.settings.surfaces != Surfaces::kAll; }
    HitMode hitMode() const { return pass_context_.settings.hit_mode; }
    bool floatColor() const { return pass_context_.settings.color_type == PixelType::kFloat; }
    /// Returns the least and the greatest distance of the scene along the viewing axis, within the
    /// near and far planes.
    std::array<float, 2> depthRange() const;
    /// Whether opacity is coloured.
    bool tinted() const { return pass_context_.settings.tinted; }
    const gl::Functions& functions() const { return context_.functions(); }
    /// Returns the bytes of the textures for a tile's opaque bound.
    std::uint64_t boundBytes(std::uint64_t tile_pixels) const;
    /// Frees the textures of the opaque bound. The next bounded pass renders the bound again.
    void freeBound();

  private:
    /// Binds the uniform record of view, tile and band, and the sampler of the peeling textures.
    void bindFrame();
    /// Returns the projection to the clip space of the tile.
    glm::dmat4 clipFromView() const;
    void fillClip(shader::FrameRecord& record) const;
    bool shown(const GeometryPass& pass, const Draw& draw) const;
    /// Returns `area` relative to the tile, y up: x0, y0, x1, y1.
    Window inTile(const Window& area) const;
    void uploadDrawRecords();
    void bindMaterial(std::size_t material) const;
    Window grown(const Window& bounds, const Draw& draw) const;
    void submit(const Draw& draw) const;
    void renderOpaqueBound();

    const gl::Context& context_;
    const GpuScene& scene_;
    const PassContext& pass_context_;
    gl::Buffer frame_record_, draw_records_, instance_records_;
    ShaderVariants shaders_;
    std::vector<Window> screen_bounds_;  // by draw: bounds in the tile, y up
    std::vector<int> boundary_nodes_;    // nodes of the clip meshes, sorted
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
