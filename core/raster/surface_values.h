// SPDX-License-Identifier: Apache-2.0
// Surface attributes without GL: interpolated vertex attributes, and textures, at their finest
// level or filtered.
#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <glm/glm.hpp>
#include <memory>
#include <span>
#include <vector>

#include <peeler/capture_settings.h>
#include <peeler/channels.h>
#include <peeler/layered_image.h>
#include <peeler/view.h>
#include "core/fragments/surface_channels.h"
#include "core/raster/texture_levels.h"
#include "core/scene/posed_scene.h"

namespace peeler {

/// Returns the weighted mean of a triangle's vertex attributes.
template <class Value, class Index>
glm::vec<Value::length(), double> weighted(const std::vector<Value>& values,
                                           const std::array<Index, 3>& vertex,
                                           const std::array<double, 3>& weight) {
    using Sum = glm::vec<Value::length(), double>;
    return weight[0] * Sum(values[vertex[0]]) + weight[1] * Sum(values[vertex[1]]) +
           weight[2] * Sum(values[vertex[2]]);
}

/// Samples a texture with its wrap modes and magnification filter. Returns RGBA, 0 to 1. `uv` is in
/// the texture's UV set, before KHR_texture_transform. `srgb`: R, G and B are linearised before
/// filtering.
glm::dvec4 texelAt(const Image& image, const TextureRef& texture, const glm::dvec2& uv,
                   bool srgb = false);

/// Returns texelAt()'s alpha.
double alphaAt(const Image& image, const TextureRef& texture, const glm::dvec2& uv);

/// Returns a window with all texels that texelAt() reads at points between these corners (in their
/// convex hull). It is the whole width or height if the points lie on both sides of a repetition of
/// the image, or are not finite.
Window texelsAround(const Image& image, const TextureRef& texture,
                    std::span<const glm::dvec2> corners);

/// Samples an image with the sampler's wrap modes, to the nearest texel or bilinearly. `at`: (0, 0)
/// is the image's upper left corner, (1, 1) its lower right one.
glm::dvec4 texelIn(const Image& image, const Sampler& sampler, const glm::dvec2& at, bool nearest,
                   bool srgb);

/// Throws Error (kInternal) if the settings request a picture or features that only pictures have
/// (clip volumes, hidden surfaces, composites, samples, a layer limit).
void checkHitSettings(const CaptureSettings& settings);

/// Returns the values of the channels (core/image/channels.h) for every hit of a band, as shaders
/// would compute them. Records are laid out like FragmentSources::values: shadedComponents() floats
/// per hit. `keys` has one entry per hit. Rows run in parallel; the result does not depend on their
/// order. `levels`: mipmaps, with which textures are filtered over the footprints of pixels; null
/// for textures at their finest level.
std::vector<float> surfaceValues(const PosedScene& posed, const View& view,
                                 const LayeredImage& band, std::span<const std::uint32_t> keys,
                                 std::span<const Channel> channels,
                                 const TextureLevels* levels = nullptr);

/// Fills the channels of a band of hits, which are the arrays behind that of the keys, extra[0].
/// `color_type` is the type of channels like colours. `levels` is as for surfaceValues(), `next` as
/// in FragmentSources.
void fillHitChannels(const PosedScene& posed, const View& view, std::span<const Channel> channels,
                     PixelType color_type, LayeredImage& band,
                     const TextureLevels* levels = nullptr, const NextFrame* next = nullptr);

/// The colours of hits without light: base colour and opacity, with filtered textures, as
/// Shading::kUnlit shades them (shaders/shade.glsl). The opacity of glass is a single alpha
/// (shaders/transmission.glsl).
class SurfaceColors {
  public:
    explicit SurfaceColors(PosedScene posed);

    /// Writes the colours of a ray's hits: linear Rec. 709, premultiplied. Thread-safe.
    void ofRay(const View& view, const glm::ivec2& pixel, std::span<const std::uint32_t> keys,
               std::span<glm::vec4> colors) const;
    /// Writes the colours of the hits of a ray from `first` on in a band. Splats have theirs there.
    void ofRay(const View& view, const glm::ivec2& pixel, const LayeredImage& band,
               std::size_t first, std::span<glm::vec4> colors) const;
    /// Sets the colours of a band of hits, LayeredImage::color, in parallel.
    void addTo(const View& view, LayeredImage& band) const;

    std::uint64_t mostBytes() const { return levels_->mostBytes(); }

  private:
    PosedScene posed_;
    std::unique_ptr<TextureLevels> levels_;
};

}  // namespace peeler
