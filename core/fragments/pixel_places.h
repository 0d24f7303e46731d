// SPDX-License-Identifier: Apache-2.0
// Places of a picture that are shaded once for several samples of a pixel.
#pragma once

#include <array>
#include <bit>
#include <cstddef>
#include <cstdint>
#include <glm/glm.hpp>
#include <span>

namespace peeler {

/// The number of samples of a pixel that is shaded once per triangle: the most that every GL
/// renderer rasterises at once.
inline constexpr std::size_t kPixelSamples = 4;

/// The draw-order keys of the triangles that the samples of a pixel show; 0 = none.
using SampleKeys = std::array<std::uint32_t, kPixelSamples>;

/// A triangle in a pixel.
struct PixelPlace {
    std::uint32_t pixel = 0;    ///< index of the pixel
    std::uint32_t samples = 0;  ///< bit s: sample s shows the triangle
};

/// Calls f(key, samples) for each triangle of a pixel, in the order of their first samples.
template <class F>
void forEachPlace(const SampleKeys& keys, F&& f) {
    constexpr std::uint32_t kAll = (1U << kPixelSamples) - 1;
    for (std::uint32_t left = kAll; left != 0;) {
        const std::uint32_t key = keys[static_cast<std::size_t>(std::countr_zero(left))];
        std::uint32_t alike = 0;
        for (std::size_t sample = 0; sample < kPixelSamples; ++sample)
            alike |= (keys[sample] == key ? 1U : 0U) << sample;
        left &= ~alike;
        if (key != 0) f(key, alike);
    }
}

/// Returns the number of triangles of a pixel.
inline std::size_t numberOfPlaces(const SampleKeys& keys) {
    std::size_t number = 0;
    forEachPlace(keys, [&](std::uint32_t, std::uint32_t) { ++number; });
    return number;
}

/// Returns the mean of the positions of `samples` (bits): the point where a triangle is shaded. It
/// lies in the triangle.
inline glm::dvec2 centroid(std::uint32_t samples, std::span<const glm::dvec2> positions) {
    glm::dvec2 sum(0);
    for (std::size_t sample = 0; sample < positions.size(); ++sample)
        if ((samples >> sample & 1U) != 0) sum += positions[sample];
    return sum / static_cast<double>(std::popcount(samples));
}

}  // namespace peeler
