// SPDX-License-Identifier: Apache-2.0
// The value of keyframes at a time, and where the nodes of a scene are then.
#pragma once

#include <map>
#include <span>
#include <vector>

#include "core/scene/scene.h"

namespace peeler {

/// Evaluates keyframes (glTF 2.0 §3.11, appendix C) at a time that is rounded to a float, as theirs
/// are: exactly the key's value at its time, the first or the last one before and after them.
/// `value` has the width of one value. Of quaternions (x, y, z, w: `rotation`) kLinear is a
/// spherical interpolation along the shorter arc.
void sampleKeyframes(const Keyframes& keyframes, double time, bool rotation,
                     std::span<double> value);

/// When the last key of the animation is, in seconds; 0 if it has none.
double durationOf(const Animation& animation);

/// Where every node of a scene is at a moment, and how its meshes are morphed.
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
