// SPDX-License-Identifier: Apache-2.0
#include "core/views/many_cameras.h"

#include <algorithm>
#include <cmath>
#include <glm/gtc/matrix_transform.hpp>
#include <limits>
#include <numbers>
#include <random>

#include <peeler/bundle.h>
#include <peeler/error.h>
#include "core/base/hypotenuse.h"

namespace peeler {
namespace {

/// Returns a random number in [0, 1) with 53 bits. Replaces std::uniform_real_distribution, which
/// may differ between libraries.
double uniform(std::mt19937_64& random) {
    return static_cast<double>(random() >> 11U) * 0x1p-53;
}

/// Returns the directions from the centre to the cameras.
std::vector<glm::dvec3> standpoints(const ViewsAround& asked) {
    if (asked.around == Around::kSphere) return sphereDirections(asked.count);
    if (asked.around == Around::kHemisphere) return hemisphereDirections(asked.count);
    std::vector<glm::dvec3> directions;
    std::mt19937_64 random(asked.seed);
    for (int i = 0; i < asked.count; ++i) {
        double y = std::sin(glm::radians(asked.elevation));
        double turn = (asked.clockwise ? -1.0 : 1.0) * i / asked.count + asked.azimuth / 360;
        // Archimedes: random points on a sphere have evenly distributed heights.
        if (asked.around == Around::kRandom) {
            y = 2 * uniform(random) - 1;
            turn = uniform(random);
        }
        const double across = std::sqrt(std::max(0.0, 1 - y * y)),
                     angle = 2 * std::numbers::pi * turn;
        directions.emplace_back(across * std::sin(angle), y, across * std::cos(angle));
    }
    return directions;
}

/// An eye's position relative to the centre of the turn: `back` against the viewing direction, `up`
/// along the picture's up vector.
struct TurntableEye {
    double back, up;
};

glm::dvec3 upInPicture(const glm::dvec3& forward) {
    const glm::dvec3 right = glm::normalize(glm::cross(forward, glm::dvec3(0, 1, 0)));
    return glm::cross(right, forward);
}

/// Returns the nearest eye from which the solid of revolution that the scene sweeps fits into the
/// picture.
TurntableEye turntableEye(const SceneExtent& extent, const glm::dvec3& centre,
                          const glm::dvec3& forward, const Projection& projection) {
    const std::vector<glm::dvec2> profile = extent.profile(centre);
    const double size = sceneSize(extent.bounds());
    const auto reach = [&](const glm::dvec3& direction) {
        const double across = hypotenuse(direction.x, direction.z);
        double farthest = profile.empty() ? 0.5 * size * glm::length(direction)
                                          : -std::numeric_limits<double>::infinity();
        for (const glm::dvec2& p : profile)
            farthest = std::max(farthest, p.x * across + p.y * direction.y);
        return farthest;
    };
    const glm::dvec3 eye = framingEye(reach, size, false, forward, {0, 1, 0}, projection);
    return {-glm::dot(eye, forward), glm::dot(eye, upInPicture(forward))};
}

}  // namespace

std::vector<CameraChoice> viewsAround(const ViewsAround& asked, const SceneExtent& extent) {
    const Bounds bounds = extent.bounds();
    const glm::dvec3 middle = (bounds.min + bounds.max) * 0.5;
    const double half_height = std::tan(glm::radians(asked.fov) / 2);
    const double half_width = half_height * asked.size.width / asked.size.height;
    const double radius = glm::length(bounds.max - bounds.min) / 2;
    // At the default distance, a sphere around the bounds fills the narrower field of view except
    // for the margin.
    const double narrow = std::atan(std::min(half_width, half_height) * (1 - 2 * kFramingMargin));
    const double usual = radius > 0 ? radius / std::sin(narrow) : 2 * sceneSize(bounds);
    const double distance = asked.distance.value_or(usual);
    const double focal = asked.size.height / (2 * half_height);

    const double inset = asked.through_corners ? 0 : 0.5;  // pixel centres have integer coordinates
    const std::vector<glm::dvec3> directions = standpoints(asked);
    std::optional<TurntableEye> turntable;
    if (asked.around == Around::kTurntable && !asked.distance)
        turntable = turntableEye(extent, middle, -directions.front(),
                                 {.half_width = half_width, .half_height = half_height});
    std::vector<CameraChoice> cameras;
    for (const glm::dvec3& direction : directions) {
        CameraChoice& camera = cameras.emplace_back();
        camera.size = asked.size;
        camera.intrinsics = {focal, focal, asked.size.width / 2.0 - inset,
                             asked.size.height / 2.0 - inset};
        glm::dvec3 eye = middle + distance * direction;
        if (turntable)
            eye = middle + turntable->back * direction + turntable->up * upInPicture(-direction);
        auto pose = lookAlong(eye, -direction, {0, 1, 0});
        if (!pose) pose = lookAlong(eye, -direction, {0, 0, -1});  // looks straight down or up
        camera.pose = *pose;
    }
    return cameras;
}

glm::dmat4 Normalizing::matrix() const {
    return glm::translate(glm::scale(glm::dmat4(1), glm::dvec3(scale)), -middle);
}

Normalizing normalizing(const PosedScene& posed, Normalized to) {
    const Bounds bounds = SceneExtent(posed).bounds();
    Normalizing result{.middle = (bounds.min + bounds.max) * 0.5};
    const glm::dvec3 size = bounds.max - bounds.min;
    double length = std::max({size.x, size.y, size.z});
    if (to == Normalized::kUnitSphere) {
        length = 0;
        for (const MeshInstance& instance : posed.meshes()) {
            for (std::size_t i = 0; i < posed.primitives(instance).size(); ++i) {
                for (const glm::vec3& position : posed.positions(instance, i)) {
                    const glm::dvec3 point(instance.world * glm::dvec4(position, 1));
                    length = std::max(length, glm::distance(point, result.middle));
                }
            }
        }
    }
    if (!posed.bounds() || !(length > 0))
        throw Error(ErrorKind::kInput, "the scene has no extent to normalise", "",
                    "leave " + Parameter::kNormalize + " out");
    result.scale = 1 / length;
    return result;
}

}  // namespace peeler
