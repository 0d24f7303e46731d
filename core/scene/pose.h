// SPDX-License-Identifier: Apache-2.0
// Where the nodes of a scene are at a time.
#pragma once

#include <map>
#include <span>
#include <vector>

#include "core/scene/scene.h"

namespace peeler {

struct Pose {
    std::vector<glm::dmat4> locals;              ///< of every node, relative to its parent
    std::map<int, std::vector<double>> weights;  ///< of nodes whose morph weights are animated
};

/// As the file places its nodes.
Pose restPose(const Scene& scene);

/// At a time in seconds, as these animations (indices into Scene::animations) have it; where two
/// change the same property, the later one counts. What they leave alone is at rest.
Pose poseAt(const Scene& scene, std::span<const int> animations, double time);

}  // namespace peeler
