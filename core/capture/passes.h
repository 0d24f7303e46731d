// SPDX-License-Identifier: Apache-2.0
// What a pass is (which shader runs over what, with which state, into which framebuffer), and which
// program draws what in it.
#pragma once

#include <array>
#include <cstdint>
#include <map>
#include <optional>
#include <string>
#include <string_view>
#include <tuple>
#include <vector>

#include "core/capture/gpu_scene.h"
#include "core/capture/pass_context.h"
#include "core/gl/functions.h"
#include "core/gl/objects.h"
#include "core/gl/program.h"

namespace peeler {

/// Four integers for a shader's uniform at location 0.
using ShaderArgument = std::optional<std::array<int, 4>>;

/// Which draws a geometry pass shows, by the alpha mode of their materials.
enum class Draws : std::uint8_t {
    kAll,
    kOpaque,     ///< OPAQUE and MASK, if no light passes through
    kBlended,    ///< the others: BLEND, and what transmits light
    kClipMeshes  ///< the boundary of the clip volume, which no other pass shows; both faces
};

/// The definition of a pass whose render target are the list heads (ListHeadTarget).
inline constexpr std::string_view kFetchedListHeads = "FETCHED_LIST_HEADS";
/// The same, with fragments that store their entries in place of their primitives
/// (shaders/a_buffer.frag).
inline constexpr std::string_view kEntriesAsKeys = "FETCHED_LIST_HEADS ENTRIES_AS_KEYS";

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
    /// Likewise those behind the fragments of an OpaqueTarget, which is bound for reading, and
    /// whose depths the framebuffer has. What is drawn stores nothing if it is behind them.
    bool in_front = false;
    GLuint framebuffer = 0;
    gl::DepthTest depth_test = gl::DepthTest::kOff;
    std::array<gl::Blend, gl::kMaxAttachments> blend{};
    ShaderArgument argument{};

    /// The same pass over what is transparent and in front of the fragments of an OpaqueTarget.
    GeometryPass inFront() const {
        GeometryPass pass = *this;
        pass.draws = Draws::kBlended;
        pass.bounded = false;
        pass.in_front = true;
        pass.depth_test = gl::DepthTest::kInFront;
        return pass;
    }
};

/// A pass without geometry: the fragment shader runs once for every pixel.
struct FullScreenPass {
    std::string_view fragment_shader = "";
    std::string_view definitions = "";
    GLuint framebuffer = 0;
    gl::DepthTest depth_test = gl::DepthTest::kOff;
    std::array<gl::Blend, gl::kMaxAttachments> blend{};
    ShaderArgument argument{};
};

/// What a pass looks at of a material, a draw, the view and its lights is compiled into its
/// program, so that a shader spends nothing on what is not there. Draws that have the same in the
/// eyes of a pass share a program; programs are compiled when they are first asked for, and stay.
class ShaderVariants {
  public:
    /// All must outlive it; the programs are for the pass context as it is when asked for.
    ShaderVariants(const gl::Functions& gl, const GpuScene& scene, const PassContext& pass_context)
        : gl_(gl), scene_(scene), pass_context_(pass_context) {}

    /// The program that draws `draw` in a geometry pass. Throws like gl::Program.
    const gl::Program& variant(const GeometryPass& pass, const Draw& draw);
    /// The program of these files, of which there is one. The definitions are separated by spaces;
    /// what says how fragments are stored joins them. Throws like gl::Program.
    const gl::Program& program(const std::vector<std::string_view>& files,
                               std::string_view definitions);

  private:
    /// Bits that stand for definitions, and the flags of material and draw as far as the pass looks
    /// at them.
    struct Variant {
        unsigned bits = 0;
        std::uint32_t material_flags = 0, draw_flags = 0;
        std::uint32_t transformed = 0, second_uv = 0;  // textures, by unit
        std::uint32_t channels = 0;                    // that the pass describes, a bit each
        std::string_view stored;                       // how fragments are
        bool operator<(const Variant& other) const {
            return std::tie(bits, material_flags, draw_flags, transformed, second_uv, channels,
                            stored) < std::tie(other.bits, other.material_flags, other.draw_flags,
                                               other.transformed, other.second_uv, other.channels,
                                               other.stored);
        }
    };

    Variant variantOf(const GeometryPass& pass, const Draw& draw) const;
    /// What lights make of a surface that is lit.
    unsigned lightBits() const;
    std::string definitionsOf(const GeometryPass& pass, const Variant& variant) const;

    const gl::Functions& gl_;
    const GpuScene& scene_;
    const PassContext& pass_context_;
    /// By definitions and files.
    std::map<std::string, gl::Program> programs_;
    /// By fragment shader and definitions of the pass: found without putting texts together.
    std::map<std::tuple<std::string_view, std::string_view, Variant>, const gl::Program*> variants_;
};

}  // namespace peeler
