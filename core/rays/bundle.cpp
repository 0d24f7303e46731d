// SPDX-License-Identifier: Apache-2.0
#include <peeler/bundle.h>

#include <algorithm>
#include <cmath>
#include <cstdint>
#include <limits>
#include <numbers>
#include <utility>

#include <peeler/error.h>
#include "core/lens/picture_rays.h"

namespace peeler::inline v0 {
namespace {

/// Returns `count` directions, evenly distributed over the part of the unit sphere between the
/// heights (Y) `top` and `bottom`.
std::vector<glm::dvec3> lattice(int count, double top, double bottom) {
    constexpr double kGoldenAngle = std::numbers::pi * (3 - 2.2360679774997896964);  // 3 − √5
    std::vector<glm::dvec3> directions;
    directions.reserve(static_cast<std::size_t>(count));
    for (int i = 0; i < count; ++i) {
        const double y = top + (bottom - top) * (i + 0.5) / count;
        const double across = std::sqrt(std::max(0.0, 1 - y * y)), angle = kGoldenAngle * i;
        directions.emplace_back(across * std::cos(angle), y, across * std::sin(angle));
    }
    return directions;
}

}  // namespace

std::vector<glm::dvec3> sphereDirections(int count) {
    return lattice(count, 1, -1);
}

std::vector<glm::dvec3> hemisphereDirections(int count) {
    return lattice(count, 1, 0);
}

glm::dmat3 bundleSides(const glm::dvec3& direction, double roll) {
    const glm::dvec3 forward = glm::normalize(direction);
    const bool upright = std::abs(forward.y) > 0.999;
    const glm::dvec3 right =
        glm::normalize(glm::cross(forward, upright ? glm::dvec3(0, 0, 1) : glm::dvec3(0, 1, 0)));
    const glm::dvec3 up = glm::cross(right, forward);
    const double c = std::cos(roll), s = std::sin(roll);
    return {c * right + s * up, c * up - s * right, -forward};
}

namespace {

constexpr double kMaxSide = 65536;
constexpr double kMaxRays = 1 << 30;
// The margin around the covered area, as a fraction of its size. Without it, rounding to GL's
// floats could clip geometry on the border.
constexpr double kBorderMargin = 1e-6;
// The margin in front of the scene and behind it, as a fraction of its size. It is large enough
// that GL clips nothing, and small enough to keep depth resolution.
constexpr double kEndMargin = 1e-3;

/// Returns the bounding box of `bounds` (world space) in the coordinate system whose axes are the
/// columns of `frame`.
Bounds boxIn(const glm::dmat3& frame, const Bounds& bounds) {
    constexpr double kInfinity = std::numeric_limits<double>::infinity();
    Bounds box{glm::dvec3(kInfinity), glm::dvec3(-kInfinity)};
    for (int corner = 0; corner < 8; ++corner) {
        glm::dvec3 at;
        for (int axis = 0; axis < 3; ++axis)
            at[axis] = corner >> axis & 1 ? bounds.max[axis] : bounds.min[axis];
        const glm::dvec3 inside = glm::transpose(frame) * at;
        box.min = glm::min(box.min, inside);
        box.max = glm::max(box.max, inside);
    }
    return box;
}

double extentOf(const Bounds& bounds) {
    const glm::dvec3 size = bounds.max - bounds.min;
    const double extent = std::max({size.x, size.y, size.z});
    return extent > 0 ? extent : 1;  // 1 if the scene is a single point
}

/// Returns a parallel bundle of rays `spacing` apart, around `center`. The bundle begins in front
/// of `scene` and ends behind it, whatever the depth of `center` is.
Bundle latticeBundle(std::string name, const glm::dmat3& frame, const glm::dvec3& center,
                     const glm::dvec2& rays, double spacing, const Bounds& scene) {
    if (!(rays.x <= kMaxSide && rays.y <= kMaxSide && rays.x * rays.y <= kMaxRays)) {
        throw Error(ErrorKind::kUsage, "a bundle would have more rays than 2^30", "",
                    "give a lower " + Parameter::kResolution + ", a larger " + Parameter::kSpacing +
                        " or smaller " + Parameter::kBounds);
    }
    const Bounds box = boxIn(frame, scene);  // z increases towards the start of the rays
    const double margin = kEndMargin * extentOf(scene);
    const glm::dvec3 middle = glm::transpose(frame) * center;
    Bundle bundle;
    bundle.name = std::move(name);
    View& view = bundle.view;
    view.camera_name = bundle.name;
    view.camera_to_world = glm::dmat4(frame);
    view.camera_to_world[3] =
        glm::dvec4(frame * glm::dvec3(middle.x, middle.y, box.max.z + margin), 1);
    view.width = static_cast<int>(rays.x);
    view.height = static_cast<int>(rays.y);
    view.crop = {0, 0, view.width, view.height};
    view.projection.perspective = false;
    view.projection.half_width = rays.x * spacing / 2;
    view.projection.half_height = rays.y * spacing / 2;
    view.projection.near = 0;
    view.projection.far = box.max.z - box.min.z + 2 * margin;
    return bundle;
}

/// Returns the number of rays, `spacing` apart, that cover an extent; at least one.
double raysAcross(double extent, double spacing) {
    return std::max(1.0, std::ceil(extent / spacing - kBorderMargin));
}

}  // namespace

bool Bundle::oneEye() const {
    return view.rays ? view.rays->oneEye() : view.projection.perspective;
}

double Bundle::tScale(int x, int y) const {
    if (parallel() || view.rays) return 1;
    const glm::dvec2 at = glm::dvec2(x, y) + view.sample;
    return glm::distance(worldPosition(view, at.x, at.y, 1), origin());
}

Bundle parallelBundle(std::string name, const Bounds& area, const Bounds& scene,
                      const glm::dvec3& direction, const RayGrid& grid) {
    const glm::dmat3 frame = bundleSides(direction, grid.roll);
    const Bounds box = boxIn(frame, area);
    const glm::dvec2 size = glm::dvec2(box.max - box.min) + 2 * kBorderMargin * extentOf(area);
    const double spacing =
        grid.spacing > 0 ? grid.spacing : std::max(size.x, size.y) / grid.resolution;
    Bundle bundle =
        latticeBundle(std::move(name), frame, frame * (0.5 * (box.min + box.max)),
                      {raysAcross(size.x, spacing), raysAcross(size.y, spacing)}, spacing, scene);
    bundle.view.sample = grid.shift;
    return bundle;
}

AxisBundles axisBundles(const Bounds& area, const Bounds& scene, const RayGrid& grid) {
    const glm::dvec3 size = area.max - area.min + 2 * kBorderMargin * extentOf(area);
    AxisBundles axes;
    axes.spacing =
        grid.spacing > 0 ? grid.spacing : std::max({size.x, size.y, size.z}) / grid.resolution;
    const glm::dvec3 center = 0.5 * (area.min + area.max);
    glm::dvec3 cells;
    for (int axis = 0; axis < 3; ++axis)
        cells[axis] = raysAcross(size[axis], axes.spacing);
    axes.corner = center - 0.5 * axes.spacing * cells;
    constexpr const char* kNames[] = {"axis_x", "axis_y", "axis_z"};
    for (int axis = 0; axis < 3; ++axis) {
        glm::dvec3 direction(0);
        direction[axis] = 1;
        const glm::dmat3 frame = bundleSides(direction);
        // The sides of the bundle are parallel to axes, so each dot product is a number of cells.
        const glm::dvec2 rays(glm::abs(glm::dot(frame[0], cells)),
                              glm::abs(glm::dot(frame[1], cells)));
        axes.bundles.push_back(
            latticeBundle(kNames[axis], frame, center, rays, axes.spacing, scene));
    }
    axes.cells = glm::ivec3(cells);
    return axes;
}

namespace {

/// Returns the bundle's view, centred in a larger display window.
View placed(const Bundle& bundle, int width, int height) {
    View view = bundle.view;
    if (view.rays && (view.width != width || view.height != height))
        throw Error(ErrorKind::kUsage, "pictures of different sizes do not fit into one file",
                    bundle.name, "write one file per bundle");
    if (view.rays) return view;
    const glm::ivec2 size(view.width, view.height), room = glm::ivec2(width, height) - size;
    const glm::ivec2 left_over(room.x % 2, room.y % 2), offset = room / 2;
    if (!bundle.parallel() && left_over != glm::ivec2(0)) {
        throw Error(ErrorKind::kUsage,
                    "perspective bundles whose widths or heights differ by an odd number of rays "
                    "do not fit into one file",
                    bundle.name, "write one file per bundle");
    }
    const glm::dvec2 half(view.projection.half_width, view.projection.half_height);
    // If the old and the new size differ by an odd number, the centre of the new picture is half a
    // pixel to the right of the old centre, or half a pixel below it.
    const glm::dvec2 shift = glm::dvec2(left_over) * half / glm::dvec2(size);
    view.camera_to_world[3] +=
        shift.x * view.camera_to_world[0] - shift.y * view.camera_to_world[1];
    view.projection.half_width *= double(width) / size.x;
    view.projection.half_height *= double(height) / size.y;
    view.width = width;
    view.height = height;
    view.crop = {view.crop.x0 + offset.x, view.crop.y0 + offset.y, view.crop.x1 + offset.x,
                 view.crop.y1 + offset.y};
    return view;
}

}  // namespace

std::vector<View> withCommonDisplay(std::span<const Bundle> bundles) {
    int width = 0, height = 0;
    for (const Bundle& bundle : bundles) {
        width = std::max(width, bundle.view.width);
        height = std::max(height, bundle.view.height);
    }
    // A pinhole camera cannot be moved by half a pixel. So the common width and height may exceed
    // the pinhole bundle's only by even numbers.
    for (const Bundle& bundle : bundles) {
        if (bundle.parallel()) continue;
        width += (width - bundle.view.width) % 2;
        height += (height - bundle.view.height) % 2;
        break;
    }
    std::vector<View> views;
    for (const Bundle& bundle : bundles)
        views.push_back(placed(bundle, width, height));
    return views;
}

}  // namespace peeler::inline v0
