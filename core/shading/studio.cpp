// SPDX-License-Identifier: Apache-2.0
// The built-in studio, in azimuths (from +Z toward +X) and elevations around the object. A viewer
// in front stands between +Z and +X. The key light is over the viewer's left shoulder, the dark
// side on the right. Strips at the sides and behind outline the edges of smooth shapes.
#include "core/shading/studio.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <numbers>

#include "core/base/parallel.h"

namespace peeler {
namespace {

constexpr int kParts = 2;

/// A planar rectangular emitter with soft edges, darker toward its corners.
struct SoftBox {
    double azimuth, elevation;       ///< direction of the centre, in degrees
    double half_width, half_height;  ///< half the size of the box at distance 1
    double edge;                     ///< width of the soft edge
    double vignette;                 ///< fraction of the radiance that is missing in the corners
    glm::dvec3 radiance;
};

constexpr SoftBox kSoftBoxes[] = {
    {-42, 42, 0.42, 0.34, 0.08, 0.45, {7.2, 7.0, 6.7}},    // key light
    {60, 80, 0.40, 0.26, 0.10, 0.30, {1.2, 1.2, 1.25}},    // overhead light
    {102, 16, 0.15, 0.70, 0.07, 0.30, {1.8, 1.85, 1.95}},  // tall strip on the dark side
    {165, 32, 0.18, 0.44, 0.06, 0.30, {4.8, 5.1, 5.5}},    // rim light
    {-118, 14, 0.10, 0.50, 0.06, 0.30, {2.6, 2.6, 2.6}},   // strip behind the scene, on the left
};

constexpr glm::dvec3 kNearFloor(0.16, 0.155, 0.15), kFarFloor(0.40, 0.395, 0.385);
constexpr glm::dvec3 kHorizon(0.36, 0.365, 0.375), kWall(0.20, 0.205, 0.215);
constexpr glm::dvec3 kCeiling(0.10, 0.105, 0.115);
constexpr double kDarkAzimuth = 118, kDarkness = 0.75;

double smooth(double x) {
    const double t = std::clamp(x, 0.0, 1.0);
    return t * t * (3 - 2 * t);
}

glm::dvec3 toward(double azimuth, double elevation) {
    const double a = glm::radians(azimuth), e = glm::radians(elevation);
    return {std::sin(a) * std::cos(e), std::sin(e), std::cos(a) * std::cos(e)};
}

struct PlacedBox {
    SoftBox box;
    glm::dvec3 middle, right, up;
};

std::array<PlacedBox, std::size(kSoftBoxes)> placedBoxes() {
    std::array<PlacedBox, std::size(kSoftBoxes)> placed{};
    for (std::size_t i = 0; i < placed.size(); ++i) {
        const SoftBox& box = kSoftBoxes[i];
        const glm::dvec3 middle = toward(box.azimuth, box.elevation);
        const glm::dvec3 right = glm::normalize(glm::cross(glm::dvec3(0, 1, 0), middle));
        placed[i] = {box, middle, right, glm::cross(middle, right)};
    }
    return placed;
}

/// Returns how much the box covers a direction: 0 outside the box, rising to 1 across its soft
/// edges. Sets `light` to the box's radiance in this direction.
double coverage(const PlacedBox& placed, const glm::dvec3& direction, glm::dvec3& light) {
    const double along = glm::dot(direction, placed.middle);
    if (along < 1e-3) return 0;
    const SoftBox& box = placed.box;
    const double x = glm::dot(direction, placed.right) / along;
    const double y = glm::dot(direction, placed.up) / along;
    const double covered = smooth((box.half_width - std::abs(x)) / box.edge + 0.5) *
                           smooth((box.half_height - std::abs(y)) / box.edge + 0.5);
    const double off =
        (x * x / (box.half_width * box.half_width) + y * y / (box.half_height * box.half_height)) /
        2;
    light = box.radiance * (1 - box.vignette * std::min(1.0, off));
    return covered;
}

glm::dvec3 room(const glm::dvec3& d) {
    const double up = std::max(0.0, d.y), down = std::max(0.0, -d.y);
    const glm::dvec3 above = kCeiling + (kWall - kCeiling) * (1 - smooth(1.2 * up)) +
                             (kHorizon - kWall) * (1 - smooth(up / 0.35));
    const glm::dvec3 floor = glm::mix(kFarFloor, kNearFloor, smooth(down / 0.9));
    const double side = smooth((glm::dot(d, toward(kDarkAzimuth, 0)) - 0.25) / 0.7);
    return glm::mix(floor, above, smooth((d.y + 0.04) / 0.08)) *
           (1 - kDarkness * side * smooth((d.y + 0.35) / 0.5));
}

}  // namespace

Environment studioEnvironment() {
    const auto boxes = placedBoxes();
    Environment studio;
    studio.width = kStudioWidth;
    studio.height = kStudioHeight;
    studio.is_studio = true;
    studio.radiance.resize(std::size_t{kStudioWidth} * kStudioHeight);
    parallelFor(kStudioHeight, [&](std::size_t row) {
        for (std::size_t column = 0; column < kStudioWidth; ++column) {
            glm::dvec3 sum(0);
            for (int part = 0; part < kParts * kParts; ++part) {
                const int right = part % kParts, down = part / kParts;
                const double x = static_cast<double>(column) + (right + 0.5) / kParts;
                const double y = static_cast<double>(row) + (down + 0.5) / kParts;
                const double longitude = (0.5 - x / kStudioWidth) * 2 * std::numbers::pi;
                const double latitude = (0.5 - y / kStudioHeight) * std::numbers::pi;
                const glm::dvec3 d(std::sin(longitude) * std::cos(latitude), std::sin(latitude),
                                   std::cos(longitude) * std::cos(latitude));
                glm::dvec3 radiance = room(d), light(0);
                for (const PlacedBox& box : boxes) {
                    const double covered = coverage(box, d, light);
                    if (covered > 0) radiance = glm::mix(radiance, light, covered);
                }
                sum += radiance;
            }
            // Rounds the result, so that machines whose sines differ in the last bit compute the
            // same studio.
            constexpr double kStep = 4096;
            studio.radiance[row * kStudioWidth + column] =
                glm::round(sum / double(kParts * kParts) * kStep) / kStep;
        }
    });
    return studio;
}

}  // namespace peeler
