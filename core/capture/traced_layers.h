// SPDX-License-Identifier: Apache-2.0
// Layers of views with View::rays: hits that the CPU finds, shaded on the GPU.
#pragma once

#include <cstdint>
#include <vector>

#include <peeler/layered_image.h>
#include <peeler/stage_times.h>
#include "core/capture/hit_shader.h"
#include "core/capture/pass_context.h"
#include "core/capture/scene_rasterizer.h"
#include "core/capture/shown_fragments.h"
#include "core/fragments/surface_channels.h"
#include "core/gl/context.h"
#include "core/raster/texture_levels.h"
#include "core/scene/posed_scene.h"
#include "core/trace/traced_hits.h"

namespace peeler {

/// The layers of one posed scene, for any views with View::rays. Hits are those of RayTracer, in
/// its order; `surfaces` and `opaque_only` of the settings choose among them. Their colours are
/// those of shaders/shade.glsl. Textures are filtered over the footprints of pixels.
class TracedLayers {
  public:
    /// All arguments must outlive this object, except the pose.
    TracedLayers(const gl::Context& context, PosedScene posed, SceneRasterizer& rasterizer,
                 const PassContext& pass_context);

    /// Returns the bytes of buffers that do not depend on the size of a band.
    static std::uint64_t bufferBytes() { return HitShader::bytes(); }

    /// Counts the layers of every pixel of a band, which must be as wide as the crop. Overwrites
    /// `counts`. Throws like TracedHits::plan().
    void count(const Window& band, std::vector<std::uint32_t>& counts);

    /// Captures a band with colours, the channels of the settings and, as the first extra array if
    /// `keys`, the keys. `layers`: number of nearest layers to keep; 0 = all. `next`: the frame
    /// that motion is measured against; null if nothing moves. Overwrites `out`.
    void capture(const Window& band, std::uint32_t layers, bool keys, const NextFrame* next,
                 LayeredImage& out);

    /// Returns the number of pixels of the current view that have no ray.
    std::uint64_t pixelsWithoutRay() { return planOf(pass_context_.view).without_ray; }

    /// Returns the times of the stages since the previous call.
    StageTimes takeTimes() { return hits_.takeTimes(); }

  private:
    /// A view whose hits have been found.
    struct Traced {
        View view;
        CapturePlan plan;
    };

    const CapturePlan& planOf(const View& view);
    void findHits(const Window& band, LayeredImage& out);
    void shade(LayeredImage& image);

    PosedScene posed_;
    const PassContext& pass_context_;
    TracedHits hits_;
    TextureLevels levels_;
    ShownFragments shown_;
    HitShader shader_;
    std::vector<Traced> traced_;  ///< the samples of one picture
    CaptureSettings traced_settings_;
};

}  // namespace peeler
