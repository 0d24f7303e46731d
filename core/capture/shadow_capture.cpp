// SPDX-License-Identifier: Apache-2.0
#include "core/capture/shadow_capture.h"

#include <string>
#include <utility>

#include <peeler/error.h>
#include "core/base/memory_budget.h"
#include "core/image/statistics.h"

namespace peeler {
namespace {

/// A sink that uploads the midpoints of each band to one layer of the shadow maps' texture array.
class MapSink final : public Sink {
  public:
    MapSink(const gl::Functions& gl, GLuint texture, int layer)
        : gl_(gl), texture_(texture), layer_(layer) {}

    void begin(const Plan& plan) override { projection_ = plan.view.projection; }
    void write(LayeredImage&& band) override {
        texels_.resize(band.window.pixels());
        midpoints(band, projection_, texels_);
        gl_.PixelStorei(GL_UNPACK_ALIGNMENT, 1);
        gl_.TextureSubImage3D(texture_, 0, band.window.x0, band.window.y0, layer_,
                              band.window.width(), band.window.height(), 1, GL_RED, GL_FLOAT,
                              texels_.data());
    }
    void finish() override {}

  private:
    const gl::Functions& gl_;
    GLuint texture_;
    int layer_;
    Projection projection_;
    std::vector<float> texels_;
};

void checkSize(const gl::Limits& limits, int size, int layers, const MemoryBudget& memory) {
    if (size > limits.texture_size) {
        throw Error(ErrorKind::kUsage,
                    "the GL device takes textures of at most " +
                        std::to_string(limits.texture_size) + " texels per side",
                    Parameter::kShadowSize + " " + std::to_string(size),
                    "give " + Parameter::kShadowSize + " " + std::to_string(limits.texture_size) +
                        " or less");
    }
    if (layers > limits.texture_layers) {
        throw Error(ErrorKind::kInput,
                    std::to_string(layers) +
                        " lights cast shadows, but the GL device takes at most " +
                        std::to_string(limits.texture_layers) + " shadow maps",
                    "", "render without " + Parameter::kShadows + ", or with fewer lights");
    }
    const auto side = static_cast<std::uint64_t>(size);
    const std::uint64_t bytes = side * side * static_cast<std::uint64_t>(layers) * sizeof(float);
    if (memory != 0 && bytes > memory) {
        throw Error(ErrorKind::kMemory,
                    std::to_string(layers) + " shadow maps take " + std::to_string(bytes >> 20) +
                        " MiB, but the memory budget is " + mebibytesText(memory),
                    memory.where(),
                    "give a smaller " + Parameter::kShadowSize + " than " + std::to_string(size));
    }
}

}  // namespace

ShadowMaps captureShadowMaps(GlRenderer& renderer, const gl::Context& context,
                             const std::vector<PlacedLight>& lights,
                             const CaptureSettings& settings) {
    ShadowMaps shadows{settings.shadow_size, settings.clip, {}, {}};
    shadows.maps.resize(lights.size());
    int layers = 0;
    for (std::size_t i = 0; i < lights.size(); ++i) {
        auto view = lightView(lights[i], renderer.posed());
        if (!view) continue;
        view->width = view->height = shadows.size;
        view->crop = {0, 0, shadows.size, shadows.size};
        shadows.maps[i] = {layers++, std::move(*view)};
    }
    checkSize(context.device().limits, shadows.size, layers, settings.memory);
    if (layers == 0) return shadows;
    const auto& gl = context.functions();
    shadows.texture = gl::makeTexture2DArray(gl, GL_R32F, shadows.size, shadows.size, layers);

    CaptureSettings opaque;
    opaque.opaque_only = true;
    opaque.faces = Faces::kBoth;
    opaque.shading = Shading::kUnlit;
    opaque.clip = settings.clip;
    opaque.memory = settings.memory;
    opaque.band_bytes = settings.band_bytes;
    for (const ShadowMaps::Map& map : shadows.maps) {
        if (map.layer < 0) continue;
        MapSink sink(gl, shadows.texture.name(), map.layer);
        const CapturePlan plan = renderer.plan(map.view, opaque);
        sink.begin(plan);
        renderer.capture(plan, sink);
        sink.finish();
    }
    gl::checkErrors(gl, "making shadow maps");
    return shadows;
}

}  // namespace peeler
