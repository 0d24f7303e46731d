// SPDX-License-Identifier: Apache-2.0
#include "cmd/shape.h"

#include <algorithm>
#include <cmath>
#include <limits>

#include "core/error.h"
#include "core/keyframes.h"

namespace peeler::cmd {

namespace {

constexpr int kMoments = 9;  // the first and the last among them

}  // namespace

Shape::Shape(const Scene& scene, const SceneContents& contents)
    : scene_(&scene), contents_(&contents) {
    if (const auto box = peeler::bounds(scene, contents)) boxes_.push_back(*box);
}

Shape::Shape(const Scene& scene, int scene_index, std::span<const int> animations) {
    double duration = 0;
    for (const int animation : animations)
        duration =
            std::max(duration, durationOf(scene.animations[static_cast<std::size_t>(animation)]));
    for (int i = 0; i < kMoments; ++i) {
        const double time = duration * i / (kMoments - 1);
        const auto shown = contents(scene, scene_index, poseAt(scene, animations, time));
        if (const auto box = peeler::bounds(scene, shown)) boxes_.push_back(*box);
    }
}

Bounds Shape::bounds() const {
    if (boxes_.empty()) return {glm::dvec3(-0.5), glm::dvec3(0.5)};
    Bounds all = boxes_.front();
    for (const Bounds& box : boxes_) {
        all.min = glm::min(all.min, box.min);
        all.max = glm::max(all.max, box.max);
    }
    if (!std::isfinite(glm::length(all.max - all.min)) || !std::isfinite(glm::length(all.max))) {
        throw Error(ErrorKind::kInput, "the scene reaches to infinity, so no camera can see it", "",
                    "look for huge translations or scales in the nodes");
    }
    return all;
}

double Shape::reach(const glm::dvec3& origin, const glm::dvec3& direction) const {
    if (contents_) return peeler::reach(*scene_, *contents_, origin, direction);
    double farthest = -std::numeric_limits<double>::infinity();
    for (const Bounds& box : boxes_) {
        glm::dvec3 corner;
        for (int axis = 0; axis < 3; ++axis)
            corner[axis] = direction[axis] > 0 ? box.max[axis] : box.min[axis];
        farthest = std::max(farthest, glm::dot(corner - origin, direction));
    }
    return farthest;
}

}  // namespace peeler::cmd
