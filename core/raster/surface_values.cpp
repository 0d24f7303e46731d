// SPDX-License-Identifier: Apache-2.0
#include "core/raster/surface_values.h"

#include <algorithm>
#include <cmath>

namespace peeler {

glm::dvec2 texcoordAt(const Primitive& primitive, int set,
                      const std::array<std::uint32_t, 3>& vertex,
                      const std::array<double, 3>& weight) {
    const auto& texcoords = primitive.texcoords[set == 0 ? 0 : 1];
    return texcoords.empty() ? glm::dvec2(0) : weighted(texcoords, vertex, weight);
}

glm::dvec4 texelAt(const Image&, const TextureRef&, const glm::dvec2&, bool) {
    return {};
}
std::vector<float> surfaceValues(const PosedScene&, const View&, const LayeredImage&,
                                 std::span<const std::uint32_t>, std::span<const Channel>) {
    return {};
}

}  // namespace peeler
