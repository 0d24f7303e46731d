// SPDX-License-Identifier: Apache-2.0
#include "core/capture/refine.h"

#include <algorithm>
#include <cmath>
#include <vector>

#include "core/base/parallel.h"
#include "core/scene/placed_element.h"

namespace peeler {
namespace {

struct RefinedHit {
    double z;
    std::uint32_t key, shaded;
};

bool precedes(const RefinedHit& a, const RefinedHit& b) {
    return a.z < b.z || (a.z == b.z && a.key < b.key);
}

}  // namespace

double refineHits(const FragmentSources& sources, LayeredImage& image,
                  std::span<std::uint32_t> keys, std::span<std::uint32_t> shaded) {
    const View& view = sources.view;
    const glm::dvec3 eye(view.camera_to_world[3]), axis(-view.camera_to_world[2]);
    const auto width = static_cast<std::size_t>(image.window.width());
    const auto height = static_cast<std::size_t>(image.window.height());
    std::vector<double> largest(height);
    parallelFor(height, [&](std::size_t row) {
        thread_local std::vector<RefinedHit> hits;
        for (std::size_t x = 0; x < width; ++x) {
            const std::size_t pixel = row * width + x;
            const std::uint32_t begin = image.offsets[pixel], end = image.offsets[pixel + 1];
            if (begin == end) continue;
            const glm::dvec2 at = glm::dvec2(image.window.x0 + static_cast<double>(x),
                                             image.window.y0 + static_cast<double>(row)) +
                                  view.sample;
            const glm::dvec3 origin = worldPosition(view, at.x, at.y, 0);
            const glm::dvec3 direction = worldPosition(view, at.x, at.y, 1) - origin;
            hits.clear();
            for (std::uint32_t f = begin; f < end; ++f) {
                PlacedElement element = elementOf(sources.posed, keys[f]);
                placeCorners(sources.posed, element);
                const auto weight = element.weightsAt(origin, direction);
                const double before = static_cast<double>(image.z[f]);
                double z = glm::dot(element.weighted(weight) - eye, axis);
                if (!std::isfinite(z)) z = before;
                largest[row] = std::max(largest[row], std::abs(z - before));
                hits.push_back({z, keys[f], shaded[f]});
            }
            std::sort(hits.begin(), hits.end(), precedes);
            for (std::uint32_t f = begin; f < end; ++f) {
                image.z[f] = static_cast<float>(hits[f - begin].z);
                keys[f] = hits[f - begin].key;
                shaded[f] = hits[f - begin].shaded;
            }
        }
    });
    return height == 0 ? 0 : *std::max_element(largest.begin(), largest.end());
}

}  // namespace peeler
