// SPDX-License-Identifier: Apache-2.0
// Hits of triangles, with the weights that interpolate vertex attributes.
#pragma once

#include <array>
#include <glm/glm.hpp>
#include <vector>

#include <peeler/scene.h>
#include "core/lens/picture_rays.h"
#include "core/raster/surface_values.h"
#include "core/raster/texture_levels.h"
#include "core/scene/elements.h"
#include "core/scene/posed_scene.h"

namespace peeler {

/// A hit of a pixel's ray. Vectors are in world space.
struct SurfacePoint {
    const PosedScene& posed;
    const WorldElement& element;
    const Material& material;
    std::array<double, 3> weight;
    glm::dvec3 direction;  ///< direction of the ray, not normalised
    glm::dvec3 facet;      ///< normal of the triangle, toward the ray; not normalised
    double side = 1;       ///< −1 if the ray hits the back
    const TextureLevels* levels = nullptr;  ///< null: textures at their finest level
    /// The change of `weight` from a pixel to the next, to the right and downwards.
    std::array<std::array<double, 3>, 2> weight_per{};

    template <class Value>
    auto mean(const std::vector<Value>& values) const {
        return weighted(values, element.corners.vertex, weight);
    }
    Geometry geometry() const {
        return {element.instance->mesh, element.origin.primitive, element.instance->deformed};
    }
    const std::vector<glm::vec2>& texcoords(int set) const {
        return posed.texcoords(geometry(), set == 0 ? 0 : 1);
    }
    glm::dvec2 texcoord(int set) const {
        const auto& values = texcoords(set);
        return values.empty() ? glm::dvec2(0) : mean(values);
    }
    /// Returns the texel at the hit; ones if there is no texture.
    glm::dvec4 textured(const TextureRef& texture, bool srgb) const;
    TextureFootprint footprint(int set) const {
        const auto& values = texcoords(set);
        if (values.empty()) return {};
        const auto& vertex = element.corners.vertex;
        return {weighted(values, vertex, weight_per[0]), weighted(values, vertex, weight_per[1])};
    }
};

/// Returns the hit of an element by a ray in world space. `change`: the change of the ray from a
/// pixel to the next, which gives SurfacePoint::weight_per; null if it is not needed.
SurfacePoint surfacePoint(const PosedScene& posed, const WorldElement& element, const Ray& ray,
                          const RayDifferentials* change = nullptr,
                          const TextureLevels* levels = nullptr);

}  // namespace peeler
