// SPDX-License-Identifier: Apache-2.0
// Many cameras that stand around one scene, and the size to which data sets bring what is in the
// middle.
#pragma once

#include <cstdint>
#include <glm/glm.hpp>
#include <optional>
#include <vector>

#include <peeler/camera_choice.h>
#include "core/scene/framing.h"
#include "core/scene/posed_scene.h"

namespace peeler {

/// Where cameras stand around the middle of a scene.
enum class Around : std::uint8_t {
    kSphere,      ///< evenly on all sides (a spherical Fibonacci lattice)
    kHemisphere,  ///< evenly on the upper half
    kOrbit,       ///< on a circle, 30° above the horizon
    kRandom,      ///< on all sides by chance
};

struct ViewsAround {
    int count = 1;
    Around around = Around::kSphere;
    std::uint64_t seed = 0;            ///< of chance
    std::optional<double> distance{};  ///< of the eye from the middle, scene units
    double fov = 40;                   ///< vertical, degrees
    /// Rays go through the upper left corners of pixels, not their centres: some who make data sets
    /// let a picture's axis be at half of its size in pixels that are counted from 0.
    bool through_corners = false;
    Size size{};  ///< with a height
};

/// Cameras that look at the middle of the scene's bounds. +Y is up in every picture, as far as can
/// be. Without a distance they stand so far away that a sphere around the bounds fits into the
/// picture, the same for all. They are calibrated cameras (CameraChoice::pose and intrinsics), so
/// that files of cameras hold all there is to know of them. The same numbers make the same cameras
/// on every machine.
std::vector<CameraChoice> viewsAround(const ViewsAround& asked, const SceneExtent& extent);

/// To which size a scene is brought.
enum class Normalized : std::uint8_t {
    kUnitCube,   ///< the longest side of its bounds is 1
    kUnitSphere  ///< the vertex that is farthest from the middle of its bounds is at distance 1
};

/// A matrix that scales alike in all directions, and moves the middle of the bounds to the origin.
struct Normalizing {
    double scale = 1;
    glm::dvec3 middle{0};  ///< before it is scaled

    glm::dmat4 matrix() const;
};

/// What normalises a scene in this pose. Throws Error (kInput) if it has no extent.
Normalizing normalizing(const PosedScene& posed, Normalized to);

}  // namespace peeler
