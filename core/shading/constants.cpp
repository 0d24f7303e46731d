// SPDX-License-Identifier: Apache-2.0
#include "core/shading/constants.h"

namespace peeler {
namespace {

// Embeds the file that write_constants.cpp writes. The assembler includes it unchanged, because
// compilers are slow on arrays of this size.
asm(".pushsection .rodata\n"
    ".balign 64\n"
    ".globl peeler_constants\n"
    "peeler_constants:\n"
    ".incbin \"" PEELER_CONSTANTS
    "\"\n"
    ".popsection\n");

}  // namespace

extern "C" const Constants peeler_constants;

const Constants& constants() {
    return peeler_constants;
}

Environment embeddedStudio() {
    Environment studio;
    studio.width = kStudioWidth;
    studio.height = kStudioHeight;
    studio.radiance.assign(constants().studio.begin(), constants().studio.end());
    studio.is_studio = true;
    return studio;
}

EnvironmentMaps embeddedStudioMaps() {
    EnvironmentMaps maps;
    const glm::vec3* texels = constants().studio_radiance.data();
    for (int level = 0; level < kStudioLevels; ++level) {
        const int size = kStudioFace >> level;
        const glm::vec3* end = texels + 6 * pixelsOf(size, size);
        maps.radiance.push_back({size, {texels, end}});
        texels = end;
    }
    const auto& irradiance = constants().studio_irradiance;
    maps.irradiance = {kStudioIrradianceFace, {irradiance.begin(), irradiance.end()}};
    return maps;
}

}  // namespace peeler
