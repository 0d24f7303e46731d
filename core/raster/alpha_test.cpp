// SPDX-License-Identifier: Apache-2.0
#include "core/raster/alpha_test.h"

#include "core/raster/surface_values.h"

namespace peeler {

AlphaTest::AlphaTest(const Scene& scene, const Primitive& primitive)
    : primitive_(&primitive),
      material_(&scene.materials[static_cast<std::size_t>(primitive.material)]) {
    if (material_->base_color_texture)
        image_ = &scene.images[static_cast<std::size_t>(material_->base_color_texture.image)];
}

bool AlphaTest::passes(const std::array<std::uint32_t, 3>& vertex,
                       const std::array<double, 3>& weight) const {
    double alpha = double{material_->base_color.a};
    if (image_) {
        const TextureRef& texture = material_->base_color_texture;
        const auto& texcoords = primitive_->texcoords[texture.texcoord == 0 ? 0 : 1];
        const glm::dvec2 uv =
            texcoords.empty() ? glm::dvec2(0) : weighted(texcoords, vertex, weight);
        alpha *= texelAt(*image_, texture, uv).a;
    }
    if (!primitive_->colors.empty()) alpha *= weighted(primitive_->colors, vertex, weight).a;
    // As the shaders have it, in single precision.
    const auto value = static_cast<float>(alpha);
    return material_->alpha_mode == AlphaMode::kMask ? value >= material_->alpha_cutoff : value > 0;
}

}  // namespace peeler
