// SPDX-License-Identifier: Apache-2.0
// Sets of cameras around a scene, and normalisation of scenes to the size usual in data sets.
#pragma once

#include <cstdint>
#include <glm/glm.hpp>
#include <optional>
#include <vector>

#include <peeler/camera_choice.h>
#include "core/scene/framing.h"
#include "core/scene/posed_scene.h"

namespace peeler {

/// The placement of cameras around the centre of a scene.
enum class Around : std::uint8_t {
    kSphere,      ///< evenly in all directions (a spherical Fibonacci lattice)
    kHemisphere,  ///< evenly over the upper half
    kOrbit,       ///< on a horizontal circle
    kTurntable,   ///< on a horizontal circle, at the smallest possible distance
    kRandom,      ///< randomly in all directions
};

struct ViewsAround {
    int count = 1;
    Around around = Around::kSphere;
    std::uint64_t seed = 0;            ///< for kRandom
    std::optional<double> distance{};  ///< from the centre to the eye, scene units
    double elevation = 30;   ///< orbit, turntable: angle above the horizon, degrees, −90 to 90
    double azimuth = 0;      ///< orbit, turntable: first camera; 0 = +Z, 90 = +X; degrees
    bool clockwise = false;  ///< orbit, turntable: direction, seen from above
    double fov = 40;         ///< vertical field of view, degrees
    /// Whether rays go through the upper left corners of pixels instead of their centres. Data-set
    /// tools do so if they count pixels from 0 and put the principal point at half the picture's
    /// size.
    bool through_corners = false;
    Size size{};  ///< must have width and height
};

/// Returns cameras that look at the centre of the scene's bounds. +Y is up in every picture, as far
/// as possible. If no distance is given, a sphere around the bounds fits into each picture; on a
/// turntable, the solid of revolution that the scene sweeps fits, and is centred vertically. The
/// cameras are calibrated (CameraChoice::pose and intrinsics), so that camera files describe them
/// completely. The same settings give the same cameras on every machine.
std::vector<CameraChoice> viewsAround(const ViewsAround& asked, const SceneExtent& extent);

/// The target size of a normalised scene.
enum class Normalized : std::uint8_t {
    kUnitCube,   ///< the longest side of the bounds is 1
    kUnitSphere  ///< the vertex farthest from the centre of the bounds is at distance 1
};

/// A translation of the bounds' centre to the origin, followed by a uniform scaling.
struct Normalizing {
    double scale = 1;
    glm::dvec3 middle{0};  ///< centre of the bounds before scaling

    glm::dmat4 matrix() const;
};

/// Returns the normalisation of a scene in this pose. Throws Error (kInput) if the scene has no
/// extent.
Normalizing normalizing(const PosedScene& posed, Normalized to);

}  // namespace peeler
