// SPDX-License-Identifier: Apache-2.0
// Rays from outside a scene, many of them aimed at corners and edges, and a count of those that hit
// closed surfaces an odd number of times.
#pragma once

#include <algorithm>
#include <cmath>
#include <cstdint>
#include <glm/glm.hpp>
#include <numbers>
#include <random>
#include <vector>

#include "core/base/sparse_set.h"
#include "core/rays/solids.h"
#include "core/scene/elements.h"
#include "core/trace/ray_tracer.h"

namespace peeler::test {

class AimedRays {
  public:
    struct Odd {
        std::uint64_t rays = 0;   ///< rays that hit a closed solid an odd number of times
        std::uint64_t hits = 0;   ///< hits on closed solids
        std::uint64_t aimed = 0;  ///< rays aimed at a corner or a middle of an edge
    };

    explicit AimedRays(const PosedScene& posed) : posed_(posed), solids_(posed) {
        const Bounds box = posed.bounds().value();
        centre_ = 0.5 * (box.min + box.max);
        radius_ = 0.5 * glm::length(box.max - box.min);
        for (const DrawnSurface& surface : posed.drawList().surfaces()) {
            const WorldElement element = elementOf(posed, surface.first_key);
            if (element.primitive->topology < Topology::kTriangles) continue;
            const std::uint64_t count = elementsOf(*element.primitive);
            for (std::uint32_t i = 0; i < count; ++i)
                keys_.push_back(surface.first_key + i);
        }
    }

    const Solids& solids() const { return solids_; }

    /// Returns rays that begin at twice the scene's radius: in turn through a corner, through the
    /// middle of an edge, in the plane of a triangle, and in any direction.
    std::vector<Ray> rays(std::size_t count, unsigned seed) const {
        std::mt19937_64 random(seed);
        std::uniform_real_distribution<double> unit(0, 1);
        const auto sphere = [&] {
            const double z = 2 * unit(random) - 1, a = 2 * std::numbers::pi * unit(random);
            const double r = std::sqrt(std::max(0.0, 1 - z * z));
            return glm::dvec3(r * std::cos(a), r * std::sin(a), z);
        };
        std::vector<Ray> rays;
        while (rays.size() < count) {
            WorldElement element = elementOf(posed_, keys_[random() % keys_.size()]);
            placeCorners(posed_, element);
            const auto& corner = element.corner;
            Ray ray{centre_ + 2 * radius_ * sphere(), {}};
            glm::dvec3 aim = corner[random() % 3];
            const std::size_t kind = rays.size() % 4;
            if (kind == 1) aim = 0.5 * (corner[0] + corner[1]);
            if (kind == 2) {
                // From far away along an edge, or in the triangle's plane.
                const glm::dvec3 along =
                    corner[1] - corner[0] +
                    (random() % 2 == 0 ? 0.0 : unit(random)) * (corner[2] - corner[0]);
                if (!(glm::length(along) > 0)) continue;
                ray.origin = aim - 4 * radius_ * glm::normalize(along);
            }
            if (kind == 3) aim = centre_ + radius_ * unit(random) * sphere();
            ray.direction = aim - ray.origin;
            rays.push_back(ray);
        }
        return rays;
    }

    /// Traces rays and counts those that hit a closed solid an odd number of times.
    Odd odd(const RayTracer& tracer, std::size_t count, unsigned seed) const {
        constexpr std::size_t kAtOnce = 100'000;
        Odd odd;
        SolidSpans spans;
        for (std::size_t first = 0; first < count; first += kAtOnce, ++seed) {
            const std::vector<Ray> chunk = rays(std::min(kAtOnce, count - first), seed);
            RayHits hits;
            tracer.trace(chunk, {Faces::kBoth}, hits);
            odd.aimed += chunk.size() / 4 * 3;
            for (std::size_t i = 0; i < chunk.size(); ++i) {
                if (hits.count(i) == 0) continue;
                const auto at = static_cast<std::size_t>(hits.offsets[i]);
                spans.find(std::span(hits.t).subspan(at, hits.count(i)),
                           std::span(hits.keys).subspan(at, hits.count(i)), solids_);
                bool any = false;
                for (const auto& [solid, found] : spans.hits()) {
                    if (!solids_.all()[solid].closed()) continue;
                    odd.hits += found.hits;
                    any = any || found.odd();
                }
                odd.rays += any ? 1 : 0;
            }
        }
        return odd;
    }

  private:
    PosedScene posed_;
    Solids solids_;
    glm::dvec3 centre_{0};
    double radius_ = 0;
    std::vector<std::uint32_t> keys_;
};

}  // namespace peeler::test
