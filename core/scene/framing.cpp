// SPDX-License-Identifier: Apache-2.0
// Extents of a scene, and fitting the scene into a frame.
#include "core/scene/framing.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <limits>
#include <set>
#include <utility>

#include <peeler/error.h>
#include "core/base/cross.h"
#include "core/base/hypotenuse.h"
#include "core/scene/elements.h"

namespace peeler {
namespace {

constexpr std::size_t kEvenMoments = 9, kMostKeys = 24;

/// Returns moments in seconds: kEvenMoments evenly spaced times from the first key to the last, and
/// the times of all keys. If there are more than kMostKeys keys, takes kMostKeys evenly chosen
/// keys.
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

std::array<glm::dvec3, 8> corners(const Bounds& bounds) {
    std::array<glm::dvec3, 8> points;
    for (int i = 0; i < 8; ++i) {
        points[static_cast<std::size_t>(i)] = {i & 1 ? bounds.max.x : bounds.min.x,
                                               i & 2 ? bounds.max.y : bounds.min.y,
                                               i & 4 ? bounds.max.z : bounds.min.z};
    }
    return points;
}

/// Keeps only the corners of the points' convex hull (Andrew's monotone chain).
void keepHull(std::vector<glm::dvec2>& points) {
    std::ranges::sort(points, [](const glm::dvec2& a, const glm::dvec2& b) {
        return a.x < b.x || (a.x == b.x && a.y < b.y);
    });
    std::vector<glm::dvec2> hull;
    const auto addChain = [&](const std::vector<glm::dvec2>& chain) {
        const std::size_t first = hull.size();
        for (const glm::dvec2& p : chain) {
            while (hull.size() >= first + 2) {
                const glm::dvec2 a = hull[hull.size() - 2], ab = hull.back() - a, ap = p - a;
                if (cross(ab, ap) > 0) break;
                hull.pop_back();
            }
            hull.push_back(p);
        }
    };
    addChain(points);
    std::ranges::reverse(points);
    addChain(points);
    points = std::move(hull);
}

}  // namespace

SceneExtent::SceneExtent(const PosedScene& posed) : posed_(posed) {
    if (const auto box = posed.bounds()) boxes_.push_back(*box);
}

SceneExtent::SceneExtent(const Scene& scene, int scene_index, std::span<const int> animations)
    : moves_(true) {
    for (const double time : momentsOf(scene, animations)) {
        const PosedScene posed(scene, scene_index, poseAt(scene, animations, time));
        if (!posed_) posed_ = posed;
        if (const auto box = posed.bounds()) boxes_.push_back(*box);
    }
}

Bounds SceneExtent::bounds() const {
    if (boxes_.empty()) return {glm::dvec3(-0.5), glm::dvec3(0.5)};
    Bounds all = boxes_.front();
    for (const Bounds& box : boxes_) {
        all.min = glm::min(all.min, box.min);
        all.max = glm::max(all.max, box.max);
    }
    if (!std::isfinite(glm::length(all.max - all.min)) || !std::isfinite(glm::length(all.max))) {
        throw Error(ErrorKind::kInput, "the scene extends to infinity, so no camera can see it", "",
                    "look for huge translations or scales in the nodes");
    }
    return all;
}

double SceneExtent::reach(const glm::dvec3& origin, const glm::dvec3& direction) const {
    if (!moves_) return posed_->reach(origin, direction);
    double farthest = -std::numeric_limits<double>::infinity();
    for (const Bounds& box : boxes_) {
        glm::dvec3 corner;
        for (int axis = 0; axis < 3; ++axis)
            corner[axis] = direction[axis] > 0 ? box.max[axis] : box.min[axis];
        farthest = std::max(farthest, glm::dot(corner - origin, direction));
    }
    return farthest;
}

std::vector<glm::dvec2> SceneExtent::profile(const glm::dvec3& centre) const {
    constexpr std::size_t kMostPoints = 4096;  // further points are reduced to their hull
    std::vector<glm::dvec2> points;
    std::size_t most = kMostPoints;
    const auto add = [&](const glm::dvec3& p) {
        points.emplace_back(hypotenuse(p.x - centre.x, p.z - centre.z), p.y - centre.y);
        if (points.size() < most) return;
        keepHull(points);
        most = points.size() + kMostPoints;
    };
    if (moves_) {
        for (const Bounds& box : boxes_)
            for (const glm::dvec3& corner : corners(box))
                add(corner);
    } else if (posed_) {
        for (const MeshInstance& instance : posed_->meshes())
            for (std::size_t i = 0; i < posed_->primitives(instance).size(); ++i)
                for (const glm::vec3& position : posed_->positions(instance, i))
                    add(glm::dvec3(instance.world * glm::dvec4(position, 1)));
    }
    keepHull(points);
    return points;
}

double SceneExtent::facing(const glm::dvec3& direction) const {
    double fronts = 0, backs = 0;
    if (!posed_) return 0;
    for (const MeshInstance& instance : posed_->meshes()) {
        const glm::dmat3 to_world(instance.world);
        const std::vector<Primitive>& primitives = posed_->primitives(instance);
        for (std::size_t i = 0; i < primitives.size(); ++i) {
            const std::vector<glm::vec3>& positions = posed_->positions(instance, i);
            const std::uint64_t elements = elementsOf(primitives[i]);
            for (std::uint64_t e = 0; e < elements; ++e) {
                const Corners corners = cornersOf(primitives[i], static_cast<std::uint32_t>(e));
                if (corners.count != 3) break;
                std::array<glm::dvec3, 3> p;
                for (std::size_t c = 0; c < 3; ++c)
                    p[c] = to_world * glm::dvec3(positions[corners.vertex[c]]);
                double area = glm::dot(glm::cross(p[1] - p[0], p[2] - p[0]), direction);
                if (instance.mirrored) area = -area;
                (area > 0 ? fronts : backs) += std::abs(area);
            }
        }
    }
    return fronts + backs > 0 ? (fronts - backs) / (fronts + backs) : 0;
}

namespace {

/// The fraction of the frame that a framed scene may fill.
constexpr double kFill = 1 - 2 * kFramingMargin;

/// A scene is flat if its thickness is less than this fraction of its second-smallest extent.
/// (Boards with labels have 0.005 to 0.042; tiles, flat boxes and machines on a plate have 0.1 or
/// more.)
constexpr double kFlat = 0.05;

/// A flat scene is viewed from behind if its SceneExtent::facing() from the front is less than
/// this.
constexpr double kTurned = -0.25;

}  // namespace

namespace {

/// Rotates `v` from a scene whose up direction is +Y to a scene whose up direction is `up`. Takes
/// the shortest rotation (Rodrigues; if cos = −1, a half turn about X).
glm::dvec3 turnedTo(const glm::dvec3& up, const glm::dvec3& v) {
    const glm::dvec3 axis = glm::cross(glm::dvec3(0, 1, 0), up);
    const double cosine = up.y;
    if (cosine < -1 + 1e-12) return {v.x, -v.y, -v.z};
    return v * cosine + glm::cross(axis, v) + axis * (glm::dot(axis, v) / (1 + cosine));
}

}  // namespace

glm::dvec3 pleasingForward(const glm::dvec3& up) {
    const double azimuth = glm::radians(35.0), elevation = glm::radians(20.0);
    const glm::dvec3 from{std::sin(azimuth) * std::cos(elevation), std::sin(elevation),
                          std::cos(azimuth) * std::cos(elevation)};
    return -glm::normalize(turnedTo(up, from));
}

FramingDirection framingDirection(const SceneExtent& extent, const glm::dvec3& up) {
    const Bounds bounds = extent.bounds();
    const glm::dvec3 sides = bounds.max - bounds.min, pleasing = pleasingForward(up);
    int thin = 0;
    for (int axis = 1; axis < 3; ++axis)
        if (sides[axis] < sides[thin]) thin = axis;
    const double second = std::min(sides[(thin + 1) % 3], sides[(thin + 2) % 3]);
    if (!(sides[thin] < kFlat * second)) return {pleasing, up};
    glm::dvec3 forward(0);
    forward[thin] = pleasing[thin] > 0 ? 1 : -1;
    if (extent.facing(-forward) < kTurned) forward = -forward;
    // If the camera looks straight down or up, the scene's front is at the bottom of the picture.
    if (std::abs(glm::dot(forward, up)) > 0.99) return {forward, turnedTo(up, {0, 0, -1})};
    return {forward, up};
}

double sceneSize(const Bounds& bounds) {
    const double diagonal = glm::length(bounds.max - bounds.min);
    if (diagonal > 0) return diagonal;
    const glm::dvec3 place = glm::max(glm::abs(bounds.min), glm::abs(bounds.max));
    // The scene is a single point. Any size suffices that keeps eye and target distinct in double
    // precision.
    return std::max(1.0, 1e-3 * std::max({place.x, place.y, place.z}));
}

namespace {

/// Returns the shift along `axis` that centres the scene for an eye at `distance`. With this shift,
/// two planes of equal slope, one on either side of the eye, both touch the scene. Finds their
/// slope by iteration. `slope` is the start value: with this slope and the shift `known`, the scene
/// fits between the planes. Returns `known` if the iteration does not converge, for example if the
/// scene surrounds the eye.
double centringShift(const Reach& reach, const glm::dvec3& axis, const glm::dvec3& forward,
                     double slope, double distance, double known) {
    // Each step multiplies the error by about the size of the scene divided by `distance`.
    constexpr int kSteps = 8;
    double shift = known;
    for (int step = 0; step < kSteps; ++step) {
        const double positive = reach(axis - slope * forward);
        const double negative = reach(-axis - slope * forward);
        const double touching = (positive + negative) / (2 * distance);
        if (!(touching >= 0)) return known;
        shift = (positive - negative) / 2;
        if (std::abs(touching - slope) <= 1e-9 * slope) return shift;
        if (step + 1 == kSteps) return touching <= 1.01 * slope ? shift : known;
        slope = touching;
    }
    return shift;
}

}  // namespace

glm::dvec3 framingEye(const Reach& reach, double size, bool centred, const glm::dvec3& forward,
                      const glm::dvec3& up, const Projection& projection) {
    const glm::dvec3 right = glm::normalize(glm::cross(forward, up));
    const glm::dvec3 above = glm::cross(right, forward);
    // Flat scenes and single points need no room sideways, but the eye must stay in front of them.
    // The eye must also stay in front of the origin, because the camera looks at the origin, which
    // may lie outside the scene.
    double distance = std::max(reach(-forward), 0.0) + 0.05 * size;
    glm::dvec2 shift(0);
    const std::array<std::pair<glm::dvec3, double>, 2> axes = {
        {{right, projection.half_width}, {above, projection.half_height}}};
    for (int i = 0; i < 2; ++i) {
        const auto& [axis, half] = axes[static_cast<std::size_t>(i)];
        // Two planes pass through the origin: one for the picture's side in the direction of `axis`
        // (right or top), one for the opposite side. The planes are parallel to the sides of the
        // frustum without its margins (perspective camera) or to the viewing axis (orthographic
        // camera). `positive` and `negative` are the scene's extents beyond the two planes,
        // measured along `axis`.
        const double slope = projection.perspective ? kFill * half : 0;
        const double positive = reach(axis - slope * forward);
        const double negative = reach(-axis - slope * forward);
        if (!centred) shift[i] = (positive - negative) / 2;
        if (slope > 0)
            distance =
                std::max(distance, std::max(positive - shift[i], negative + shift[i]) / slope);
    }
    if (projection.perspective && !centred) {
        for (int i = 0; i < 2; ++i) {
            const auto& [axis, half] = axes[static_cast<std::size_t>(i)];
            shift[i] = centringShift(reach, axis, forward, kFill * half, distance, shift[i]);
        }
    }
    return right * shift.x + above * shift.y - forward * distance;
}

DepthRange depthRange(const Bounds& bounds, const glm::dmat4& camera_to_world) {
    const glm::dvec3 forward = -glm::dvec3(camera_to_world[2]), eye(camera_to_world[3]);
    DepthRange range{std::numeric_limits<double>::infinity(),
                     -std::numeric_limits<double>::infinity()};
    for (const glm::dvec3& corner : corners(bounds)) {
        const double depth = glm::dot(corner - eye, forward);
        range.nearest = std::min(range.nearest, depth);
        range.farthest = std::max(range.farthest, depth);
    }
    return range;
}

}  // namespace peeler
