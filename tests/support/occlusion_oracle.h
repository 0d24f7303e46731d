// SPDX-License-Identifier: Apache-2.0
// Independent oracle of ambient occlusion: every receiver sends its own rays through Embree.
#pragma once

#include <cmath>
#include <glm/glm.hpp>
#include <numbers>
#include <vector>

#include "core/bake/bake.h"
#include "core/base/parallel.h"
#include "support/embree.h"
#include "support/embree_oracle.h"

namespace peeler::test {

/// Computes the unoccluded, cosine-weighted share of the hemisphere at receivers.
class OcclusionOracle {
  public:
    /// Ignores hits nearer than `own_surface` (scene units), which are on the receiver's own
    /// surface. Rays must start on this surface, because a start above it could be inside a
    /// touching part.
    OcclusionOracle(const TriangleSoup& soup, float own_surface)
        : scene_(soup), own_surface_(own_surface) {}

    /// Returns the unoccluded share for each receiver. Uses only `directions` above the receiver's
    /// surface.
    std::vector<float> along(const Receivers& receivers,
                             const std::vector<glm::dvec3>& directions) const {
        return forEach(receivers, [&](const glm::vec3& position, const glm::vec3& normal) {
            double open = 0, all = 0;
            for (const glm::dvec3& direction : directions) {
                const glm::vec3 toward(direction);
                const double cosine = static_cast<double>(glm::dot(toward, normal));
                if (cosine <= 0) continue;
                all += cosine;
                if (!occluded(position, toward)) open += cosine;
            }
            return all > 0 ? open / all : 0;
        });
    }

    /// Returns the reference: the unoccluded share for each receiver, from `count`
    /// cosine-distributed directions around the receiver's normal. Rays start at the height
    /// `raised` (scene units) above the surface.
    std::vector<float> reference(const Receivers& receivers, int count, float raised = 0) const {
        std::vector<glm::dvec3> lobe;  // around +Z (Malley's method on a Fibonacci disc)
        for (int i = 0; i < count; ++i) {
            const double square = (i + 0.5) / count, angle = 2.399963229728653 * i;
            lobe.emplace_back(std::sqrt(square) * std::cos(angle),
                              std::sqrt(square) * std::sin(angle), std::sqrt(1 - square));
        }
        return forEach(receivers, [&](const glm::vec3& position, const glm::vec3& normal) {
            const glm::vec3 side = glm::normalize(glm::cross(
                normal, std::abs(normal.x) < 0.5F ? glm::vec3(1, 0, 0) : glm::vec3(0, 1, 0)));
            const glm::mat3 frame(side, glm::cross(normal, side), normal);
            int open = 0;
            for (const glm::dvec3& direction : lobe)
                open += occluded(position + raised * normal, frame * glm::vec3(direction)) ? 0 : 1;
            return static_cast<double>(open) / count;
        });
    }

  private:
    bool occluded(const glm::vec3& position, const glm::vec3& direction) const {
        RTCRay ray = embreeRay(position, direction);
        ray.tnear = own_surface_;
        occluded1(scene_, &ray);
        return ray.tfar < 0;
    }

    /// Returns the unoccluded share for each receiver; 0 for receivers without a normal, as in
    /// bake().
    template <class Share>
    static std::vector<float> forEach(const Receivers& receivers, const Share& share) {
        constexpr std::size_t kAtOnce = 64;
        std::vector<float> values(receivers.size());
        parallelFor((values.size() + kAtOnce - 1) / kAtOnce, [&](std::size_t group) {
            const std::size_t end = std::min(values.size(), (group + 1) * kAtOnce);
            for (std::size_t r = group * kAtOnce; r < end; ++r)
                if (receivers.normals[r] != glm::vec3(0))
                    values[r] = static_cast<float>(
                        share(glm::vec3(receivers.positions[r]), receivers.normals[r]));
        });
        return values;
    }

    EmbreeScene scene_;
    float own_surface_;
};

/// Returns the root mean square difference over the receivers with a nonzero normal.
inline double rootMeanSquare(const Receivers& receivers, const std::vector<float>& values,
                             const std::vector<float>& reference) {
    double sum = 0, count = 0;
    for (std::size_t r = 0; r < values.size(); ++r) {
        if (receivers.normals[r] == glm::vec3(0)) continue;
        const double difference = static_cast<double>(values[r] - reference[r]);
        sum += difference * difference;
        ++count;
    }
    return count > 0 ? std::sqrt(sum / count) : 0;
}

}  // namespace peeler::test
