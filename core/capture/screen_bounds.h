// SPDX-License-Identifier: Apache-2.0
// Where on the screen geometry can appear at most.
#pragma once

#include <glm/glm.hpp>
#include <limits>
#include <span>

#include "core/base/window.h"

namespace peeler {

/// The smallest axis-parallel box around some points; none yet: inside out.
struct Box {
    glm::vec3 min{std::numeric_limits<float>::infinity()};
    glm::vec3 max{-std::numeric_limits<float>::infinity()};

    bool empty() const { return !(min.x <= max.x); }
    void add(std::span<const glm::vec3> points);
};

/// The pixels, y up, of a viewport of this size on which a GPU can put anything of the box: no
/// pixel less, whatever it rounds in single precision, though often some more. All of them where
/// the box reaches behind the eye.
Window screenBounds(const Box& box, const glm::dmat4& clip_from_model, int width, int height);

}  // namespace peeler
