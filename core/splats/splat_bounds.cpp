// SPDX-License-Identifier: Apache-2.0
#include "core/splats/splat_bounds.h"

#include <glm/gtc/quaternion.hpp>

namespace peeler {

std::optional<Bounds> splatBounds(const PosedScene& posed) {
    std::optional<Bounds> box;
    for (const MeshInstance& instance : posed.meshes()) {
        for (std::size_t p = 0; p < posed.primitives(instance).size(); ++p) {
            const Splats* const splats = posed.primitives(instance)[p].splats.get();
            for (std::size_t i = 0; splats && i < splats->size(); ++i) {
                const glm::dvec4 q(splats->rotations[i]);
                const glm::dmat3 axes =
                    glm::dmat3(instance.world) * glm::mat3_cast(glm::dquat(q.w, q.x, q.y, q.z));
                glm::dvec3 reach(0);  // variances along the world's axes
                for (int axis = 0; axis < 3; ++axis) {
                    const glm::dvec3 side = axes[axis] * double{splats->scales[i][axis]};
                    reach += side * side;
                }
                const glm::dvec3 three = 3.0 * glm::sqrt(reach);
                const glm::dvec3 mean(instance.world *
                                      glm::dvec4(posed.positions(instance, p)[i], 1));
                if (!box) box = Bounds{mean, mean};
                box->min = glm::min(box->min, mean - three);
                box->max = glm::max(box->max, mean + three);
            }
        }
    }
    return box;
}

}  // namespace peeler
