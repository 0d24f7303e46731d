// SPDX-License-Identifier: Apache-2.0
#include "core/views/many_cameras.h"

#include <algorithm>
#include <cmath>
#include <glm/gtc/matrix_transform.hpp>
#include <numbers>
#include <random>

#include <peeler/bundle.h>
#include <peeler/error.h>

namespace peeler {
namespace {

constexpr double kOrbitElevation = 30;  // degrees

/// Returns a random number in [0, 1) with 53 bits. std::uniform_real_distribution would give
/// different numbers with different libraries.
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
        double y = std::sin(glm::radians(kOrbitElevation));
        double turn = static_cast<double>(i) / asked.count;
        // A sphere's points have evenly distributed heights (Archimedes).
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

}  // namespace

std::vector<CameraChoice> viewsAround(const ViewsAround& asked, const SceneExtent& extent) {
    const Bounds bounds = extent.bounds();
    const glm::dvec3 middle = (bounds.min + bounds.max) * 0.5;
    const double half_height = std::tan(glm::radians(asked.fov) / 2);
    const double half_width = half_height * asked.size.width / asked.size.height;
    const double radius = glm::length(bounds.max - bounds.min) / 2;
    // At the default distance, a sphere around the bounds touches the edges of the narrower field
    // of view.
    const double narrow = std::atan(std::min(half_width, half_height) * (1 - 2 * kFramingMargin));
    const double usual = radius > 0 ? radius / std::sin(narrow) : 2 * sceneSize(bounds);
    const double distance = asked.distance.value_or(usual);
    const double focal = asked.size.height / (2 * half_height);

    const double inset = asked.through_corners ? 0 : 0.5;  // pixel centres have integer coordinates
    std::vector<CameraChoice> cameras;
    for (const glm::dvec3& direction : standpoints(asked)) {
        CameraChoice& camera = cameras.emplace_back();
        camera.size = asked.size;
        camera.intrinsics = {focal, focal, asked.size.width / 2.0 - inset,
                             asked.size.height / 2.0 - inset};
        const glm::dvec3 eye = middle + distance * direction;
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
