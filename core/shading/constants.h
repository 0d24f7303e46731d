// SPDX-License-Identifier: Apache-2.0
// Expensive constants, computed at build time (write_constants.cpp) and embedded in the program.
#pragma once

#include <array>
#include <cstddef>
#include <glm/glm.hpp>

#include "core/shading/albedo_table.h"
#include "core/shading/environment_maps.h"
#include "core/shading/studio.h"

namespace peeler {

/// Texels per side of a face, in the sharpest level of the studio's radiance and in its irradiance.
inline constexpr int kStudioFace = 128, kStudioIrradianceFace = 16;
inline constexpr int kStudioLevels = 5;

constexpr std::size_t pixelsOf(int width, int height) {
    return static_cast<std::size_t>(width) * static_cast<std::size_t>(height);
}

constexpr std::size_t studioRadianceTexels() {
    std::size_t texels = 0;
    for (int level = 0; level < kStudioLevels; ++level)
        texels += 6 * pixelsOf(kStudioFace >> level, kStudioFace >> level);
    return texels;
}

/// The constants in their embedded layout, which contains only floats.
struct Constants {
    std::array<glm::vec3, pixelsOf(kStudioWidth, kStudioHeight)> studio;  ///< studioEnvironment()
    /// prefilter() of the studio: its radiance, level after level.
    std::array<glm::vec3, studioRadianceTexels()> studio_radiance;
    std::array<glm::vec3, 6 * pixelsOf(kStudioIrradianceFace, kStudioIrradianceFace)>
        studio_irradiance;
    std::array<glm::vec4, pixelsOf(kAlbedoTableSize, kAlbedoTableSize)> albedos;  ///< albedoTable()
    std::array<glm::vec4, pixelsOf(kAlbedoTableSize, kAlbedoTableSize)> lobes;    ///< lobeTable()
};

const Constants& constants();

/// Returns a copy of the embedded studioEnvironment().
Environment embeddedStudio();

/// Returns a copy of the studio's embedded prefilter() result.
EnvironmentMaps embeddedStudioMaps();

}  // namespace peeler
