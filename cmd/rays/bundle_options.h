// SPDX-License-Identifier: Apache-2.0
// Options for bundles of rays.
#pragma once

#include <filesystem>
#include <glm/glm.hpp>
#include <optional>
#include <vector>

#include <peeler/bundle.h>
#include "cmd/options/camera_options.h"
#include "cmd/options/lens_options.h"
#include "cmd/options/view_options.h"
#include "core/scene/posed_scene.h"

namespace peeler::cmd {

class VerbOptions;

/// The requested bundles of rays.
struct BundleOptions {
    std::vector<glm::dvec3> directions;  ///< unit vectors in world space
    std::optional<int> count;            ///< number of directions, spread evenly over the sphere
    bool hemisphere = false;             ///< whether the directions cover only the upper hemisphere
    std::optional<std::filesystem::path> file;  ///< text file of directions
    bool axes = false;                          ///< bundles along X, Y and Z, on a common lattice
    CameraOptions camera;   ///< traces one ray per pixel, if any camera option is given
    LensOptions lens;       ///< of `camera`, and of views around the scene
    ViewListOptions views;  ///< several cameras, one bundle for each
    std::optional<std::filesystem::path> shutter;  ///< poses of a camera that moves (--shutter)
    std::optional<std::filesystem::path> rays;     ///< file of rays, instead of all others
    /// The density: number of rays along the longer side of a bundle, or distance between rays in
    /// scene units.
    std::optional<int> resolution;
    std::optional<double> spacing;
    std::optional<Bounds> bounds;  ///< box that bundles cover; none = the scene's bounds

    /// Whether the options request any rays.
    bool asksForRays() const {
        return usesCamera() || axes || count || file || rays || !directions.empty();
    }
    bool usesCamera() const {
        return views.asked() || shutter || lens.isGiven() || camera.camera ||
               camera.buildsCamera() || camera.intrinsics || camera.near || camera.far ||
               camera.crop;
    }
    RayGrid grid() const;
};

/// Declares --direction … --bounds and the options of addCameraOptions() and addViewOptions(). All
/// arguments must outlive the parse.
void addBundleOptions(VerbOptions& verb, BundleOptions& options,
                      SceneReadOptions* reading = nullptr);

/// Returns the bundle of a camera whose poses are in a file (shutterPicture()). Without options of
/// a camera, the file's first camera has the size and the focal lengths. Throws Error (kUsage) if
/// the file has fewer than two poses, and like readCameras().
Bundle shutterBundle(const BundleOptions& options, const PosedScene& posed,
                     const SceneExtent& extent, ReadWarnings& warnings);

/// Throws Error (kUsage) if the options request no rays or contradict each other. Does not need the
/// scene.
void checkBundleOptions(const BundleOptions& options);

/// Reads directions from a text file and normalises them. Each line has three numbers, separated by
/// blanks or commas. Directions may have any length but 0. Skips empty lines and comments after #.
/// Throws Error (kInput), with the line, if a line is invalid.
std::vector<glm::dvec3> readDirections(const std::filesystem::path& file);

/// Returns all parallel bundles in the order of the options, with the axes last. `scene` is the
/// bounding box of everything that rays can hit. Throws like parallelBundle() and readDirections().
std::vector<Bundle> parallelBundles(const BundleOptions& options, const Bounds& scene);

}  // namespace peeler::cmd
