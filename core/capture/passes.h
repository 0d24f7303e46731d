// SPDX-License-Identifier: Apache-2.0
// Passes (shader, draws, GL state and framebuffer) and their shader variants.
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

/// Four integers for the shader uniform at location 0.
using ShaderArgument = std::optional<std::array<int, 4>>;

/// The draws of a geometry pass, selected by their material's alpha mode.
enum class Draws : std::uint8_t {
    kAll,
    kOpaque,   ///< OPAQUE and MASK materials without transmission
    kBlended,  ///< BLEND materials, and materials with transmission
    /// The boundary of the clip volume, both faces; no other value of Draws includes it.
    kClipMeshes
};

/// The shader definition for passes that render to the list heads (ListHeadTarget).
inline constexpr std::string_view kFetchedListHeads = "FETCHED_LIST_HEADS";
/// The shader definitions for passes that render to the list heads and store, instead of the
/// primitive, the index of the list entry, or the key of the instance's first primitive
/// (shaders/a_buffer.frag).
inline constexpr std::string_view kEntriesAsKeys = "FETCHED_LIST_HEADS ENTRIES_AS_KEYS";
inline constexpr std::string_view kFirstKeys = "FETCHED_LIST_HEADS FIRST_KEYS";

/// A geometry pass: a fragment shader and the draws that it runs on.
struct GeometryPass {
    std::string_view fragment_shader;
    std::string_view definitions = "";  ///< preprocessor definitions, separated by spaces
    bool shades = false;  ///< whether to evaluate the surface's colour, not only depth and alpha
    /// Whether to evaluate all material properties, regardless of lighting. The channels of the
    /// settings need them.
    bool describes = false;
    Draws draws = Draws::kAll;
    bool bounded = true;  ///< whether to skip fragments behind the opaque bound, if there is one
    /// Whether to skip the fragments that an OpaqueTarget hides. The target must be bound for
    /// reading, and its depths must be attached to the framebuffer.
    bool in_front = false;
    /// Whether the framebuffer is multisampled. With in_front, a SampleTarget then takes the place
    /// of the OpaqueTarget. The shader runs once per pixel, or for every sample if it lists, clips
    /// or tests the alpha.
    bool multisampled = false;
    GLuint framebuffer = 0;
    gl::DepthTest depth_test = gl::DepthTest::kOff;
    std::array<gl::Blend, gl::kMaxAttachments> blend{};
    ShaderArgument argument{};

    /// Returns this pass, restricted to the transparent fragments in front of an OpaqueTarget's
    /// fragments.
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

/// Shader variants. A program contains only the code for the features of material, draw, view and
/// lights that a pass uses. Draws with the same features share a program. Programs are compiled on
/// first use and kept.
class ShaderVariants {
  public:
    /// All arguments must outlive this object. Calls use the current state of the pass context.
    ShaderVariants(const gl::Functions& gl, const GpuScene& scene, const PassContext& pass_context)
        : gl_(gl), scene_(scene), pass_context_(pass_context) {}

    /// Returns the program that draws `draw` in a geometry pass. Throws like gl::Program.
    const gl::Program& variant(const GeometryPass& pass, const Draw& draw);
    /// Returns the program with these source files, these definitions (separated by spaces) and the
    /// definition of the fragment storage. Throws like gl::Program.
    const gl::Program& program(const std::vector<std::string_view>& files,
                               std::string_view definitions);

  private:
    /// Definition bits, and the material and draw flags that the pass uses.
    struct Variant {
        unsigned bits = 0;
        std::uint32_t material_flags = 0, draw_flags = 0;
        // Bits of the texture units with a transform, and of the texture units with the second UV
        // set.
        std::uint32_t transformed = 0, second_uv = 0;
        std::uint32_t channels = 0;  // channels that the pass outputs, one bit each
        std::string_view stored;     // preprocessor definitions that select the fragment storage
        bool operator<(const Variant& other) const {
            return std::tie(bits, material_flags, draw_flags, transformed, second_uv, channels,
                            stored) < std::tie(other.bits, other.material_flags, other.draw_flags,
                                               other.transformed, other.second_uv, other.channels,
                                               other.stored);
        }
    };

    Variant variantOf(const GeometryPass& pass, const Draw& draw) const;
    /// Returns the bits that lighting needs on a lit surface.
    unsigned lightBits() const;
    std::string definitionsOf(const GeometryPass& pass, const Variant& variant) const;

    const gl::Functions& gl_;
    const GpuScene& scene_;
    const PassContext& pass_context_;
    /// Programs, keyed by definitions and files.
    std::map<std::string, gl::Program> programs_;
    /// The same programs, by fragment shader, definitions and variant. A lookup here builds no
    /// string.
    std::map<std::tuple<std::string_view, std::string_view, Variant>, const gl::Program*> variants_;
};

}  // namespace peeler
