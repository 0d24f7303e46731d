// SPDX-License-Identifier: Apache-2.0
// What a camera has to see: how far a scene reaches, at one moment or at all of them.
#pragma once

#include <glm/glm.hpp>
#include <optional>
#include <span>
#include <vector>

#include "core/scene/posed_scene.h"

namespace peeler::cmd {

class Shape {
  public:
    /// Of one moment, by its vertices.
    explicit Shape(const PosedScene& posed);

    /// Of these animations from their first key to their last, by bounding boxes at keys (24 at
    /// most) and between them: the same for every frame, so that a camera which frames the scene
    /// stands still.
    Shape(const Scene& scene, int scene_index, std::span<const int> animations);

    /// A unit cube at the origin if there is nothing. Throws Error (kInput) if it is not finite.
    Bounds bounds() const;

    /// How far it reaches from `origin` along a direction, the largest dot product; −inf if there
    /// is nothing.
    double reach(const glm::dvec3& origin, const glm::dvec3& direction) const;

  private:
    std::optional<PosedScene> posed_;  ///< none: the boxes count
    std::vector<Bounds> boxes_;
};

}  // namespace peeler::cmd
