// SPDX-License-Identifier: Apache-2.0
#include "core/shading/shadow_maps.h"

#include <string>
#include <utility>

#include "core/base/error.h"
#include "core/capture/renderer.h"
#include "core/image/midpoint.h"
#include "core/scene/light_view.h"

namespace peeler {
namespace {

/// Uploads the midpoints of each band to a layer of the array.
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
                    "the GL device takes textures of " + std::to_string(limits.texture_size) +
                        " texels a side",
                    "--shadow-size " + std::to_string(size), "make the shadow maps smaller");
    }
    if (layers > limits.texture_layers) {
        throw Error(ErrorKind::kInput,
                    std::to_string(layers) + " lights cast shadows, and the GL device takes " +
                        std::to_string(limits.texture_layers) + " shadow maps",
                    "", "render without --shadows, or with fewer lights");
    }
    const auto side = static_cast<std::uint64_t>(size);
    const std::uint64_t bytes = side * side * static_cast<std::uint64_t>(layers) * sizeof(float);
    if (memory != 0 && bytes > memory) {
        throw Error(ErrorKind::kMemory,
                    std::to_string(layers) + " shadow maps take " + std::to_string(bytes >> 20) +
                        " MiB, and the memory budget is " + mebibytesText(memory),
                    memory.where(), "give a smaller --shadow-size than " + std::to_string(size));
    }
}

}  // namespace

ShadowMaps::ShadowMaps(Renderer& renderer, const gl::Context& context,
                       const std::vector<PlacedLight>& lights, const PosedScene& posed,
                       const CaptureSettings& settings)
    : size_(settings.shadow_size), clip_(settings.clip), maps_(lights.size()) {
    int layers = 0;
    for (std::size_t i = 0; i < lights.size(); ++i) {
        auto view = lightView(lights[i], posed);
        if (!view) continue;
        view->width = view->height = size_;
        view->crop = {0, 0, size_, size_};
        maps_[i] = {layers++, std::move(*view)};
    }
    checkSize(context.device().limits, size_, layers, settings.memory);
    if (layers == 0) return;
    const auto& gl = context.functions();
    texture_ = gl::makeTexture2DArray(gl, GL_R32F, size_, size_, layers);

    CaptureSettings casters;
    casters.opaque_only = true;
    casters.faces = Faces::kBoth;
    casters.shading = Shading::kUnlit;
    casters.clip = settings.clip;
    casters.memory = settings.memory;
    casters.band_bytes = settings.band_bytes;
    for (const Map& map : maps_) {
        if (map.layer < 0) continue;
        MapSink sink(gl, texture_.name(), map.layer);
        sink.begin(renderer.plan(map.view, casters));
        renderer.capture(sink);
        sink.finish();
    }
    gl::checkErrors(gl, "making shadow maps");
}

}  // namespace peeler
