// SPDX-License-Identifier: Apache-2.0
// What a point of a surface looks like without GL: textures at their finest level, and what
// vertices say in between.
#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <glm/glm.hpp>
#include <span>
#include <vector>

#include <peeler/channels.h>
#include <peeler/layered_image.h>
#include <peeler/view.h>
#include "core/scene/posed_scene.h"

namespace peeler {

/// A mean of what the corners of a triangle have.
template <class Value, class Index>
glm::vec<Value::length(), double> weighted(const std::vector<Value>& values,
                                           const std::array<Index, 3>& vertex,
                                           const std::array<double, 3>& weight) {
    using Sum = glm::vec<Value::length(), double>;
    return weight[0] * Sum(values[vertex[0]]) + weight[1] * Sum(values[vertex[1]]) +
           weight[2] * Sum(values[vertex[2]]);
}

/// A texture's value at coordinates of the set that it uses, which are transformed as the material
/// says: 0 to 1, wrapped as the sampler does and filtered as it magnifies. `srgb`: R, G and B
/// become linear before they are filtered.
glm::dvec4 texelAt(const Image& image, const TextureRef& texture, const glm::dvec2& uv,
                   bool srgb = false);

/// Throws Error (kUsage) for a channel that surfaceValues() does not have: the tangent, for which
/// no bundle asks.
void checkSurfaceChannels(std::span<const Channel> channels);

/// What shaders yield of the channels (core/image/channels.h) of every hit of a band, as
/// FragmentSources::values has it: records of shadedComponents() floats, hit after hit. `keys` are
/// those of the hits. Rows are done in parallel; the result does not depend on how.
std::vector<float> surfaceValues(const PosedScene& posed, const View& view,
                                 const LayeredImage& band, std::span<const std::uint32_t> keys,
                                 std::span<const Channel> channels);

}  // namespace peeler
