// SPDX-License-Identifier: Apache-2.0
// Draws the scene into a raster tile with one of the fragment shaders.
#pragma once

#include <array>
#include <cstdint>
#include <map>
#include <optional>
#include <string_view>
#include <tuple>
#include <vector>

#include "core/capture_settings.h"
#include "core/gl/context.h"
#include "core/gl/objects.h"
#include "core/gl/program.h"
#include "core/gpu_scene.h"
#include "core/lighting.h"
#include "core/view.h"

namespace peeler {

namespace shader {
struct FrameRecord;
}

/// Four integers for a shader's uniform at location 0.
using ShaderArgument = std::optional<std::array<int, 4>>;

/// Which draws a geometry pass shows, by the alpha mode of their materials.
enum class Draws : std::uint8_t {
    kAll,
    kOpaque,     ///< OPAQUE and MASK, if no light passes through
    kBlended,    ///< the others: BLEND, and what transmits light
    kClipMeshes  ///< the boundary of the clip volume, which no other pass shows; both faces
};

/// The definition of a pass whose render target are the slots (SlotTarget).
inline constexpr std::string_view kFetchedSlots = "FETCHED_SLOTS";

/// A geometry pass: which fragment shader sees which draws.
struct GeometryPass {
    std::string_view fragment_shader;
    std::string_view definitions = "";  ///< for the preprocessor, separated by spaces
    bool shades = false;  ///< looks at the surface's colour, not only at depth and alpha
    /// Looks at all that the material says, whatever light makes of it, for the channels of the
    /// settings.
    bool describes = false;
    Draws draws = Draws::kAll;
    bool bounded = true;  ///< fragments behind the opaque bound, if there is one, do not count
    GLuint framebuffer = 0;
    gl::DepthTest depth_test = gl::DepthTest::kOff;
    std::array<gl::Blend, gl::kMaxAttachments> blend{};
    ShaderArgument argument{};
};

/// A pass without geometry: the fragment shader runs once for every pixel.
struct CoverPass {
    std::string_view fragment_shader = "";
    std::string_view definitions = "";
    GLuint framebuffer = 0;
    gl::DepthTest depth_test = gl::DepthTest::kOff;
    std::array<gl::Blend, gl::kMaxAttachments> blend{};
    ShaderArgument argument{};
};

/// Rasterisation is repeatable only if the viewport never changes, so the picture is divided into
/// raster tiles: a fixed grid that depends on its size alone. Inside a tile every pass of every
/// method, band and crop uses the same viewport and merely another scissor; hence they agree bit
/// for bit.
class SceneRasterizer {
  public:
    static constexpr int kTileSize = 4096;

    SceneRasterizer(const gl::Context& context, const GpuScene& scene);

    void setView(const View& view, const CaptureSettings& settings);
    /// What shines on the scene from now on; must stay until it is set anew. Its view is the
    /// caller's to set.
    void setLighting(const Lighting& lighting) { lighting_ = &lighting; }
    /// The tiles of the view that touch `area`, row by row.
    std::vector<Window> tilesOf(const Window& area) const;
    /// Makes `tile` (one of tilesOf) the target. With --surfaces visible or transparent the next
    /// bounded pass renders the opaque bound of the tile first.
    void setTile(const Window& tile);
    /// The band whose buffers the fragments go to, how many fragments they hold, and how many of
    /// the nearest layers a composite shows in order.
    void setBand(const Window& band, std::uint32_t capacity, std::uint32_t layers);

    /// Draws the scene into `area` (picture coordinates, inside the tile).
    void draw(const GeometryPass& pass, const Window& area);
    /// Runs a fragment shader over `area`.
    void cover(const CoverPass& pass, const Window& area);
    /// Runs a compute shader over `area`, which is also its argument.
    void compute(std::string_view shader, std::string_view definitions, const Window& area);

    const Window& tile() const { return tile_; }
    /// The tile's viewport and `area` as scissor.
    gl::PassState passState(GLuint framebuffer, const Window& area) const;
    /// Whether opaque surfaces hide what is behind them.
    bool bounded() const { return settings_.surfaces != Surfaces::kAll; }
    Hits hits() const { return settings_.hits; }
    bool floatColor() const { return settings_.color_type == PixelType::kFloat; }
    const gl::Functions& functions() const { return context_.functions(); }
    /// Bytes of textures a tile needs for the opaque bound.
    std::uint64_t boundBytes(std::uint64_t tile_pixels) const;
    /// Frees them. The next bounded pass renders the bound anew.
    void freeBound();

  private:
    /// What is compiled into a program: bits that stand for definitions, and the flags of material
    /// and draw as far as the pass looks at them.
    struct Variant {
        unsigned bits = 0;
        std::uint32_t material_flags = 0, draw_flags = 0;
        std::uint32_t transformed = 0, second_uv = 0;  // textures, by unit
        bool operator<(const Variant& other) const {
            return std::tie(bits, material_flags, draw_flags, transformed, second_uv) <
                   std::tie(other.bits, other.material_flags, other.draw_flags, other.transformed,
                            other.second_uv);
        }
    };

    /// Binds the record of view, tile and band, and the sampler of the peels' textures.
    void bindFrame();
    /// A program of these files; cached. The definitions are separated by spaces; what says how
    /// fragments are stored joins them.
    const gl::Program& program(const std::vector<std::string_view>& files,
                               std::string_view definitions);
    /// To the clip space of the tile.
    glm::dmat4 clipFromView() const;
    void fillClip(shader::FrameRecord& record) const;
    bool shown(const GeometryPass& pass, const Draw& draw) const;
    Variant variantOf(const GeometryPass& pass, const Draw& draw) const;
    const gl::Program& variant(const GeometryPass& pass, const Draw& draw);
    /// `area` relative to the tile, y up: x0, y0, x1, y1.
    Window inTile(const Window& area) const;
    void uploadDrawRecords();
    /// Makes the buffer at least that large; what it held is lost.
    void reserve(gl::Buffer& buffer, std::size_t bytes) const;
    void submit(const Draw& draw) const;
    void renderOpaqueBound();

    const gl::Context& context_;
    const GpuScene& scene_;
    gl::Buffer frame_record_, draw_records_, instance_records_;
    std::map<std::string, gl::Program> programs_;
    /// By fragment shader and definitions of the pass.
    std::map<std::tuple<std::string_view, std::string_view, Variant>, const gl::Program*> variants_;
    const Lighting* lighting_ = nullptr;
    View view_;
    CaptureSettings settings_;
    std::vector<Window> screen_bounds_;  // of the draws, in the tile, y up
    std::vector<int> boundary_nodes_;    // of the clip volume, sorted
    Window tile_, band_;
    std::uint32_t capacity_ = 0, layers_ = 0;
    bool frame_dirty_ = true, bound_missing_ = false;
    gl::Texture bound_depth_, bound_primitive_;
    gl::Framebuffer bound_framebuffer_;
    Window bound_size_;
    gl::SamplerObject nearest_;
    gl::VertexArray no_vertices_;
};

}  // namespace peeler
