// SPDX-License-Identifier: Apache-2.0
// Which program draws what.
#pragma once

#include <cstdint>
#include <map>
#include <string>
#include <string_view>
#include <tuple>
#include <vector>

#include "core/capture/capture_settings.h"
#include "core/capture/gpu_scene.h"
#include "core/capture/passes.h"
#include "core/gl/functions.h"
#include "core/gl/program.h"

namespace peeler {

/// What a pass looks at of a material, a draw, the view and its lights is compiled into its
/// program, so that a shader spends nothing on what is not there. Draws that have the same in the
/// eyes of a pass share a program; programs are compiled when they are first asked for, and stay.
class ShaderVariants {
  public:
    /// All must outlive it; the programs are for the shot as it is when they are asked for.
    ShaderVariants(const gl::Functions& gl, const GpuScene& scene, const Shot& shot)
        : gl_(gl), scene_(scene), shot_(shot) {}

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
    const Shot& shot_;
    /// By definitions and files.
    std::map<std::string, gl::Program> programs_;
    /// By fragment shader and definitions of the pass: found without putting texts together.
    std::map<std::tuple<std::string_view, std::string_view, Variant>, const gl::Program*> variants_;
};

}  // namespace peeler
