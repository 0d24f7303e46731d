// SPDX-License-Identifier: Apache-2.0
// Bundles of rays that are traced together, as one picture is rendered.
#pragma once

#include <cstdint>
#include <glm/glm.hpp>
#include <span>
#include <string>
#include <vector>

#include <peeler/scene.h>
#include <peeler/view.h>

#pragma GCC visibility push(default)

namespace peeler::inline v0 {

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

}  // namespace peeler::inline v0

#pragma GCC visibility pop
