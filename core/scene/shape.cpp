// SPDX-License-Identifier: Apache-2.0
#include "core/scene/shape.h"

#include <algorithm>
#include <cmath>
#include <limits>
#include <set>

#include "core/base/error.h"

namespace peeler::cmd {

namespace {

constexpr std::size_t kEvenMoments = 9, kMostKeys = 24;

/// Times evenly between the first and the last key, and keys; of too many keys some, evenly, too.
std::set<double> momentsOf(const Scene& scene, std::span<const int> animations) {
    std::set<double> keys;
    for (const int animation : animations)
        for (const Keyframes& keyframes :
             scene.animations[static_cast<std::size_t>(animation)].keyframes)
            keys.insert(keyframes.times.begin(), keyframes.times.end());
    if (keys.empty()) return {0};
    const double first = *keys.begin(), last = *keys.rbegin();
    std::set<double> moments;
    for (std::size_t i = 0; i < kEvenMoments; ++i)
        moments.insert(first + (last - first) * static_cast<double>(i) / (kEvenMoments - 1));
    const std::vector<double> all(keys.begin(), keys.end());
    const std::size_t some = std::min(all.size(), kMostKeys);
    for (std::size_t i = 0; i < some; ++i)
        moments.insert(all[some == 1 ? 0 : i * (all.size() - 1) / (some - 1)]);
    return moments;
}

}  // namespace

Shape::Shape(const PosedScene& posed) : posed_(posed) {
    if (const auto box = posed.bounds()) boxes_.push_back(*box);
}

Shape::Shape(const Scene& scene, int scene_index, std::span<const int> animations) {
    for (const double time : momentsOf(scene, animations)) {
        const PosedScene posed(scene, scene_index, poseAt(scene, animations, time));
        if (const auto box = posed.bounds()) boxes_.push_back(*box);
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
    if (posed_) return posed_->reach(origin, direction);
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
