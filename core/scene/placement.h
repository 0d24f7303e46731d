// SPDX-License-Identifier: Apache-2.0
// Where a camera or a light stands and how it is turned. Both look along −Z of their own space.
#pragma once

#include <glm/glm.hpp>
#include <optional>

namespace peeler {

/// Camera to world of a camera or light at `eye` that looks along `forward` with `up` upwards in
/// the picture. Nothing if the two are parallel or one of them has no length.
std::optional<glm::dmat4> lookAlong(const glm::dvec3& eye, const glm::dvec3& forward,
                                    const glm::dvec3& up);

/// Rotation and translation of a node's matrix, which may also scale, mirror and shear. The viewing
/// axis (−Z) keeps its direction and +Y its side of it; the picture is never mirrored.
/// Nothing if the matrix leaves no direction to look along.
std::optional<glm::dmat4> rigid(const glm::dmat4& world);

}  // namespace peeler
