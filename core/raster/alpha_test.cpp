// SPDX-License-Identifier: Apache-2.0
#include "core/raster/alpha_test.h"

#include "core/raster/surface_values.h"

namespace peeler {

AlphaTest::AlphaTest(const PosedScene& posed, const Geometry& geometry)
    : colors_(&posed.colors(geometry)) {
    const Scene& scene = posed.scene();
    const Primitive& primitive =
        scene.meshes[static_cast<std::size_t>(geometry.mesh)].primitives[geometry.primitive];
    material_ = &scene.materials[static_cast<std::size_t>(primitive.material)];
    const TextureRef& texture = material_->base_color_texture;
    if (!texture) return;
    image_ = &scene.images[static_cast<std::size_t>(texture.image)];
    texcoords_ = &posed.texcoords(geometry, texture.texcoord == 0 ? 0 : 1);
}

bool AlphaTest::passes(const std::array<std::uint32_t, 3>& vertex,
                       const std::array<double, 3>& weight) const {
    double alpha = double{material_->base_color.a};
    if (image_) {
        const glm::dvec2 uv =
            texcoords_->empty() ? glm::dvec2(0) : weighted(*texcoords_, vertex, weight);
        alpha *= texelAt(*image_, material_->base_color_texture, uv).a;
    }
    if (!colors_->empty()) alpha *= weighted(*colors_, vertex, weight).a;
    // Compare in single precision, as the shaders do.
    const auto value = static_cast<float>(alpha);
    return material_->alpha_mode == AlphaMode::kMask ? value >= material_->alpha_cutoff : value > 0;
}

}  // namespace peeler
