// SPDX-License-Identifier: Apache-2.0
#include "core/raster/alpha_test.h"

#include <algorithm>
#include <optional>

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
        alpha *= alphaAt(*image_, material_->base_color_texture, uv);
    }
    if (!colors_->empty()) alpha *= weighted(*colors_, vertex, weight).a;
    return passes(alpha);
}

bool AlphaTest::passes(double alpha) const {
    // Compare in single precision, as the shaders do.
    const auto value = static_cast<float>(alpha);
    return material_->alpha_mode == AlphaMode::kMask ? value >= material_->alpha_cutoff : value > 0;
}

std::optional<bool> AlphaTest::passesEverywhere(const std::array<std::uint32_t, 3>& vertex,
                                                const AlphaRanges* ranges) const {
    double least = double{material_->base_color.a}, greatest = least;
    if (image_) {
        std::array<glm::dvec2, 3> uv{};
        if (!texcoords_->empty())
            for (std::size_t i = 0; i < 3; ++i)
                uv[i] = glm::dvec2((*texcoords_)[vertex[i]]);
        const AlphaRanges::Range alpha =
            ranges->of(texelsAround(*image_, material_->base_color_texture, uv));
        least *= alpha.least / 255.0;
        greatest *= alpha.greatest / 255.0;
    }
    if (!colors_->empty()) {
        const auto [low, high] = std::minmax(
            {(*colors_)[vertex[0]].a, (*colors_)[vertex[1]].a, (*colors_)[vertex[2]].a});
        least *= double{low};
        greatest *= double{high};
    }
    if (!(least >= 0 && greatest >= least)) return {};
    constexpr double kRounding = 1e-12;  // more than the rounding error of an alpha
    if (passes(least * (1 - kRounding))) return true;
    if (!passes(greatest * (1 + kRounding))) return false;
    return {};
}

}  // namespace peeler
