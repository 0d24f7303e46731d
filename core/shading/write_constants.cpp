// SPDX-License-Identifier: Apache-2.0
// write_constants FILE: computes Constants at build time and writes their memory image, which
// constants.cpp embeds.
#include <algorithm>
#include <cstdio>
#include <exception>
#include <memory>
#include <stdexcept>
#include <string>
#include <vector>

#include "core/base/memory_image.h"
#include "core/shading/constants.h"

namespace peeler {
namespace {

static_assert(sizeof(Constants) % sizeof(float) == 0);

template <typename Room, typename Value>
void fill(Room& room, const std::vector<Value>& values) {
    if (values.size() != room.size())
        throw std::logic_error("core/shading/constants.h has room for " +
                               std::to_string(room.size()) + " of " +
                               std::to_string(values.size()) + " numbers");
    std::copy(values.begin(), values.end(), room.begin());
}

std::unique_ptr<Constants> calculated() {
    auto all = std::make_unique<Constants>();
    const Environment studio = studioEnvironment();
    fill(all->studio, studio.radiance);
    const EnvironmentMaps maps = prefilter(studio);
    std::vector<glm::vec3> radiance;
    for (const CubeMap& level : maps.radiance)
        radiance.insert(radiance.end(), level.texels.begin(), level.texels.end());
    fill(all->studio_radiance, radiance);
    fill(all->studio_irradiance, maps.irradiance.texels);
    fill(all->albedos, albedoTable());
    fill(all->lobes, lobeTable());
    return all;
}

}  // namespace
}  // namespace peeler

int main(int count, char** arguments) {
    if (count != 2) {
        std::fputs("usage: write_constants FILE\n", stderr);
        return 2;
    }
    try {
        peeler::writeMemoryImage(*peeler::calculated(), arguments[1]);
        return 0;
    } catch (const std::exception& error) {
        std::fprintf(stderr, "write_constants: %s: %s\n", arguments[1], error.what());
        return 1;
    }
}
