// SPDX-License-Identifier: Apache-2.0
// Filtered textures without GL: mipmaps, and footprints of pixels.
#pragma once

#include <array>
#include <cstdint>
#include <glm/glm.hpp>
#include <memory>

#include <peeler/scene.h>

namespace peeler {

/// The change of a UV set from a pixel to the next, to the right and downwards.
struct TextureFootprint {
    glm::dvec2 per_x{0}, per_y{0};
};

/// The mipmaps of a scene's images, those of GL (halved()), which are made when a sample first
/// needs them. Thread-safe.
class TextureLevels {
  public:
    /// The scene must outlive this object.
    explicit TextureLevels(const Scene& scene);
    ~TextureLevels();
    TextureLevels(const TextureLevels&) = delete;
    TextureLevels& operator=(const TextureLevels&) = delete;

    /// Samples a texture with the sampler's filters as GL does (OpenGL 4.5, §8.14), but
    /// anisotropic: the shorter axis of the footprint selects the level, and up to 16 samples along
    /// the longer axis are averaged. Returns RGBA, 0 to 1. `uv` and the footprint are in the
    /// texture's UV set, before KHR_texture_transform. `srgb`: R, G and B are linearised before
    /// filtering.
    glm::dvec4 sample(const TextureRef& texture, const glm::dvec2& uv,
                      const TextureFootprint& footprint, bool srgb) const;

    /// Returns an upper bound of the bytes that all mipmaps take.
    std::uint64_t mostBytes() const;

  private:
    struct Chain;
    const Image& level(int image, bool srgb, int level) const;

    const Scene& scene_;
    /// Two for each image: of linear colours, and of sRGB.
    std::unique_ptr<Chain[]> chains_;
};

}  // namespace peeler
