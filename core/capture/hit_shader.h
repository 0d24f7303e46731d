// SPDX-License-Identifier: Apache-2.0
// The hit shader: colours of surfaces at points of a picture, shaded on the GPU.
#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <glm/glm.hpp>
#include <span>
#include <vector>

#include "core/capture/pass_context.h"
#include "core/capture/scene_rasterizer.h"
#include "core/fragments/pixel_places.h"
#include "core/gl/context.h"
#include "core/gl/objects.h"
#include "core/scene/draw_list.h"
#include "core/scene/posed_scene.h"

namespace peeler {

/// A point of a picture, and the triangle whose colour is wanted there.
struct ShadedHit {
    glm::ivec2 pixel;       ///< picture coordinates, y down
    glm::dvec2 at;          ///< the point in the pixel (0 to 1, y down)
    std::uint32_t samples;  ///< bit s: sample s of the pixel shows the triangle
    std::uint32_t key;      ///< draw-order key of the triangle
};

/// A shader of hits. Colours are those of shaders/shade.glsl; textures are filtered over the
/// footprints of pixels.
class HitShader {
  public:
    /// The number of hits that are shaded at once.
    static constexpr std::size_t kAtOnce = std::size_t{1} << 15;

    /// All arguments must outlive this object.
    HitShader(const gl::Context& context, const PosedScene& posed, SceneRasterizer& rasterizer,
              const PassContext& pass_context);

    /// Returns the bytes that shade() needs for kAtOnce hits.
    static std::uint64_t bytes();

    /// Shades hits of the current view. Writes the first `stride` bytes of each stored colour
    /// (shaders/packed_color.glsl) to `colors`, in the order of the hits. Successive hits at one
    /// point share its ray. `positions`: the positions of a pixel's samples, multiples of 1/16
    /// (0 to 1, y down), at which textures are filtered, except normal maps; null to filter
    /// textures at the hit alone.
    void shade(std::span<const ShadedHit> hits, std::span<std::byte> colors, std::size_t stride,
               const std::array<glm::dvec2, kPixelSamples>* positions = nullptr);

  private:
    const gl::Context& context_;
    const PosedScene& posed_;
    SceneRasterizer& rasterizer_;
    const PassContext& pass_context_;
    KeyIndex draw_of_;            ///< by key
    std::vector<char> textured_;  ///< by material: whether its colour needs gradients
    gl::Buffer records_, colors_;
};

}  // namespace peeler
