// SPDX-License-Identifier: Apache-2.0
// Bundles of rays: which rays are traced together, as one picture is rendered, and what their hits
// say of points beside the rays.
#pragma once

#include <cstdint>
#include <glm/glm.hpp>
#include <limits>
#include <optional>
#include <span>
#include <string>
#include <vector>

#include "core/image/layered_image.h"
#include "core/scene/posed_scene.h"
#include "core/scene/view.h"

namespace peeler {

/// Unit vectors over the whole sphere, each for the same solid angle: the spherical Fibonacci
/// lattice (Swinbank & Purser 2006; Keinert et al., "Spherical Fibonacci Mapping", 2015).
std::vector<glm::dvec3> sphereDirections(int count);

/// Likewise over the half around +Y.
std::vector<glm::dvec3> hemisphereDirections(int count);

/// The axes of a bundle along `direction` (of any length but 0) as columns, unit vectors in world
/// space: right, up (+Y, or +Z for directions along Y, as nearly as can be, before they are turned
/// by `roll` radians) and backward, against the direction.
glm::dmat3 bundleSides(const glm::dvec3& direction, double roll = 0);

/// How dense the rays of a bundle are: so many along its longer side, or so far apart.
struct RayGrid {
    int resolution = 1024;
    double spacing = 0;     ///< scene units; 0 = by the resolution
    double roll = 0;        ///< radians by which the sides are turned about the direction
    glm::dvec2 shift{0.5};  ///< where in its cell each ray lies, 0–1, y down
};

/// A grid of rays, one through the centre of every pixel of `view`; row by row, the upper row
/// first. Its `extra[0]` being the keys (kKeyChannel), a band of such a picture is the hits of its
/// rays.
struct Bundle {
    std::string name;  ///< unique among those traced together: "bundle_000"
    View view;

    bool parallel() const { return !view.projection.perspective; }
    std::size_t rays() const { return view.crop.pixels(); }
    /// Unit vectors in world space: where the axis goes, and the sides of the picture.
    glm::dvec3 direction() const { return -glm::dvec3(view.camera_to_world[2]); }
    glm::dvec3 right() const { return glm::dvec3(view.camera_to_world[0]); }
    glm::dvec3 up() const { return glm::dvec3(view.camera_to_world[1]); }
    /// Where t = 0: in the middle of the plane that all parallel rays start from, or the eye.
    glm::dvec3 origin() const { return glm::dvec3(view.camera_to_world[3]); }
    /// Scene units; of a pinhole bundle at distance 1.
    glm::dvec2 size() const {
        return 2.0 * glm::dvec2(view.projection.half_width, view.projection.half_height);
    }
    /// t of a hit at camera Z 1 on the ray of pixel (x, y) of the picture: t is the distance from
    /// where the ray starts.
    double tScale(int x, int y) const;
};

/// Parallel rays along `direction` (of any length but 0) that cover `area` as seen from there, and
/// all of `scene` from end to end. Deterministic: the same direction gives the same sides, up being
/// +Y, or +Z for directions along Y. Throws Error (kUsage) if there would be more than 2^30 rays or
/// 65536 on a side.
Bundle parallelBundle(std::string name, const Bounds& area, const Bounds& scene,
                      const glm::dvec3& direction, const RayGrid& grid);

/// Along +X, +Y and +Z (a layered depth normal image: Chen & Wang 2008) with all rays on one
/// lattice of cubes: the rays of each go through the centres of the cells.
struct AxisBundles {
    std::vector<Bundle> bundles;  ///< three
    glm::dvec3 corner{0};         ///< least corner of the first cell, world space
    double spacing = 0;           ///< side of a cell
    glm::ivec3 cells{0};          ///< along x, y, z
};
AxisBundles axisBundles(const Bounds& area, const Bounds& scene, const RayGrid& grid);

/// The views of the bundles with the same rays, but with display windows that are all of one size,
/// as OpenEXR wants it of the parts of a file: the crop of a smaller one lies in the middle. Half a
/// pixel that is left over moves the camera of a parallel bundle. Throws Error (kUsage) for pinhole
/// bundles that would need that.
std::vector<View> withCommonDisplay(std::span<const Bundle> bundles);

// point_hits.cpp: the hits next to arbitrary points.

struct NextHit {
    /// From the point, scene units, never negative; infinite if there is no hit.
    double distance = std::numeric_limits<double>::infinity();
    std::uint32_t key = 0;  ///< 0 = none
};

/// A surface that a point lies on (but for rounding: 1e-12 of the coordinates) is before it, at
/// distance 0. Of surfaces that coincide, the one drawn last is next before a point, the one drawn
/// first next after it.
struct PointHits {
    NextHit before;  ///< at point − distance · direction
    NextHit after;   ///< at point + distance · direction
};

/// The pixel of a parallel bundle that a point (world space) falls into; nothing if it is beside
/// the bundle.
std::optional<glm::ivec2> nearestRay(const Bundle& bundle, const glm::dvec3& point);

/// Finds the hits next to those points whose nearest ray is in the band; `found`, one for each
/// point, keeps what it has for the others. The band is of a parallel bundle; its extra[0] are the
/// keys (kKeyChannel).
///
/// Rays do not go through the points. So a point's place in the list of the nearest ray is found by
/// binary search, and the primitives around that place are followed to the point's own ray: a
/// distance is exact where that meets the primitive that the nearest ray has hit. Else it is where
/// it meets the primitive's plane, or the primitive's nearest point if that is far from there. What
/// is thinner than the distance of rays can be missed. Points are done in parallel; the result does
/// not depend on how.
void findPointHits(const PosedScene& posed, const Bundle& bundle, const LayeredImage& band,
                   std::span<const glm::dvec3> points, std::span<PointHits> found);

}  // namespace peeler
