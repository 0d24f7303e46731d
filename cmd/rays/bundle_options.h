// SPDX-License-Identifier: Apache-2.0
// Bundle options.
#pragma once

#include <filesystem>
#include <glm/glm.hpp>
#include <optional>
#include <vector>

#include <peeler/bundle.h>
#include "cmd/options/camera_options.h"
#include "cmd/options/view_options.h"
#include "core/scene/posed_scene.h"

namespace peeler::cmd {

class VerbOptions;

/// The requested bundles of rays.
struct BundleOptions {
    std::vector<glm::dvec3> directions;  ///< unit vectors
    std::optional<int> count;            ///< number of further directions, evenly over the sphere
    bool hemisphere = false;             ///< those on the upper hemisphere only
    std::optional<std::filesystem::path> file;  ///< a text file of further directions
    bool axes = false;                          ///< along X, Y and Z, on one lattice
    CameraOptions camera;                       ///< if any option is given: rays through its pixels
    ViewListOptions views;                      ///< the same for many cameras, one bundle each
    /// Rays along the longer side of a bundle, or scene units between rays.
    std::optional<int> resolution;
    std::optional<double> spacing;
    std::optional<Bounds> bounds;  ///< the box that bundles cover; none = the scene's

    /// Whether any rays are requested.
    bool asksForRays() const {
        return usesCamera() || axes || count || file || !directions.empty();
    }
    bool usesCamera() const {
        return views.asked() || camera.camera || camera.buildsCamera() || camera.intrinsics ||
               camera.near || camera.far || camera.crop;
    }
    RayGrid grid() const;
};

/// Declares --direction … --bounds and the options of addCameraOptions(). All arguments must
/// outlive the parse.
void addBundleOptions(VerbOptions& verb, BundleOptions& options,
                      SceneReadOptions* reading = nullptr);

/// Throws Error (kUsage) if the options contradict each other, regardless of the scene, or if there
/// is nothing to trace.
void checkBundleOptions(const BundleOptions& options);

/// Reads directions from a text file as unit vectors. Each line has three numbers, separated by
/// blanks or commas, of any length but 0. Skips empty lines and comments after #. Throws Error
/// (kInput), with the line, if a line is invalid.
std::vector<glm::dvec3> readDirections(const std::filesystem::path& file);

/// Returns all bundles except the cameras', in the order of the options, axes last. `scene` bounds
/// everything that can be hit. Throws like parallelBundle() and readDirections().
std::vector<Bundle> parallelBundles(const BundleOptions& options, const Bounds& scene);

}  // namespace peeler::cmd
