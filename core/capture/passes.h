// SPDX-License-Identifier: Apache-2.0
// What a pass is: which shader runs over what, with which state, into which framebuffer.
#pragma once

#include <array>
#include <cstdint>
#include <optional>
#include <string_view>

#include "core/gl/objects.h"

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

/// The definition of a pass whose render target are the slots (SlotTarget).
inline constexpr std::string_view kFetchedSlots = "FETCHED_SLOTS";
/// The same, fragments telling their slots instead of their primitives: shaders/a_buffer.frag.
inline constexpr std::string_view kSlotsAsKeys = "FETCHED_SLOTS SLOTS_AS_KEYS";

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
struct FullScreenPass {
    std::string_view fragment_shader = "";
    std::string_view definitions = "";
    GLuint framebuffer = 0;
    gl::DepthTest depth_test = gl::DepthTest::kOff;
    std::array<gl::Blend, gl::kMaxAttachments> blend{};
    ShaderArgument argument{};
};

}  // namespace peeler
