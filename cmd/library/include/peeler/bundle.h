// SPDX-License-Identifier: Apache-2.0
// Bundles of rays, each traced in one pass.
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

/// Returns `count` unit vectors, evenly spread over the sphere: the spherical Fibonacci lattice
/// (Swinbank & Purser 2006; Keinert et al., "Spherical Fibonacci Mapping", 2015).
std::vector<glm::dvec3> sphereDirections(int count);

/// Returns the spherical Fibonacci lattice over the hemisphere around +Y.
std::vector<glm::dvec3> hemisphereDirections(int count);

/// Returns the axes of a bundle along `direction` (of any length but 0). The columns are unit
/// vectors in world space: right, up, and backward (opposite to the direction). At roll 0, up is as
/// close as possible to +Y, or to +Z for directions along Y. `roll` (radians) rotates right and up
/// about the direction.
glm::dmat3 bundleSides(const glm::dvec3& direction, double roll = 0);

/// The density and placement of a bundle's rays.
struct RayGrid {
    int resolution = 1024;
    double spacing = 0;  ///< distance between rays, scene units; 0 = computed from the resolution
    double roll = 0;     ///< rotation about the rays' direction, radians
    glm::dvec2 shift{0.5};  ///< position of each ray within its grid cell, 0–1, y down
};

/// A grid of rays, one per pixel of `view` (through the pixel's sample), row by row from the top.
/// Pixels for which View::rays has no ray are rays without hits.
/// The bands of a traced bundle hold the hits; `extra[0]` holds the keys of the hit primitives
/// (kKeyChannel).
struct Bundle {
    std::string name;  ///< unique among bundles traced together: "bundle_000"
    View view;

    bool parallel() const { return !view.projection.perspective; }
    /// Whether all rays begin at origin().
    bool oneEye() const;
    std::size_t rays() const { return view.crop.pixels(); }
    /// Return unit vectors in world space. direction() is the viewing axis.
    glm::dvec3 direction() const { return -glm::dvec3(view.camera_to_world[2]); }
    glm::dvec3 right() const { return glm::dvec3(view.camera_to_world[0]); }
    glm::dvec3 up() const { return glm::dvec3(view.camera_to_world[1]); }
    /// Returns the camera's position in world space: the eye, or the centre of the plane where
    /// parallel rays start (t = 0).
    glm::dvec3 origin() const { return glm::dvec3(view.camera_to_world[3]); }
    /// Returns the width and height of the grid in scene units, at distance 1 for a pinhole bundle.
    glm::dvec2 size() const {
        return 2.0 * glm::dvec2(view.projection.half_width, view.projection.half_height);
    }
    /// Returns t / Z on the ray of pixel (x, y). t is the distance from the ray's origin, Z is
    /// camera Z.
    double tScale(int x, int y) const;
};

/// Returns parallel rays along `direction` (of any length but 0) that cover the projection of
/// `area` and span `scene` in depth. The axes are those of bundleSides(). Throws Error (kUsage) if
/// there would be more than 2^30 rays, or more than 65536 on a side of the grid.
Bundle parallelBundle(std::string name, const Bounds& area, const Bounds& scene,
                      const glm::dvec3& direction, const RayGrid& grid);

/// Bundles along +X, +Y and +Z (a layered depth normal image: Chen & Wang 2008). The bundles share
/// a lattice of cubes. All rays go through cell centres.
struct AxisBundles {
    std::vector<Bundle> bundles;  ///< along +X, +Y and +Z
    glm::dvec3 corner{0};         ///< minimum corner of the first cell, world space
    double spacing = 0;           ///< edge length of a cell, scene units
    glm::ivec3 cells{0};
};
AxisBundles axisBundles(const Bounds& area, const Bounds& scene, const RayGrid& grid);

/// Returns the bundles' views with display windows of one size, because OpenEXR requires one size
/// for all parts of a file. The rays stay the same; each crop is centred in the window. If a window
/// grows by an odd number of pixels, the camera of a parallel bundle moves by half a pixel. Throws
/// Error (kUsage) if a pinhole bundle would have to move.
std::vector<View> withCommonDisplay(std::span<const Bundle> bundles);

}  // namespace peeler::inline v0

#pragma GCC visibility pop
