// SPDX-License-Identifier: Apache-2.0
// Numbers that are the same in every run and take long: calculated once, when peeler is built
// (write_constants.cpp), and part of the program.
#pragma once

#include <array>
#include <cstddef>
#include <glm/glm.hpp>

#include "core/shading/albedo_table.h"
#include "core/shading/environment_maps.h"
#include "core/shading/studio.h"

namespace peeler {

/// Texels a side of a face: of the sharpest level of the studio's radiance, of its irradiance.
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

/// Floats and nothing else, as they lie in the program.
struct Constants {
    std::array<glm::vec3, pixelsOf(kStudioWidth, kStudioHeight)> studio;  ///< studioEnvironment()
    /// prefilter() of it: levels one after the other.
    std::array<glm::vec3, studioRadianceTexels()> studio_radiance;
    std::array<glm::vec3, 6 * pixelsOf(kStudioIrradianceFace, kStudioIrradianceFace)>
        studio_irradiance;
    std::array<glm::vec4, pixelsOf(kAlbedoTableSize, kAlbedoTableSize)> albedos;  ///< albedoTable()
    std::array<glm::vec4, pixelsOf(kAlbedoTableSize, kAlbedoTableSize)> lobes;    ///< lobeTable()
};

const Constants& constants();

/// A copy of what studioEnvironment() calculates.
Environment embeddedStudio();

/// A copy of what prefilter() makes of it.
EnvironmentMaps embeddedStudioMaps();

}  // namespace peeler
