// SPDX-License-Identifier: Apache-2.0
// The options of bundles of rays.
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

/// Which bundles of rays.
struct BundleOptions {
    std::vector<glm::dvec3> directions;         ///< unit vectors, one by one
    std::optional<int> count;                   ///< so many more, evenly over the sphere
    bool hemisphere = false;                    ///< of those only the upper half
    std::optional<std::filesystem::path> file;  ///< a text file of still more
    bool axes = false;                          ///< along X, Y and Z, on one lattice
    CameraOptions camera;                       ///< if any of them is given: the rays of its pixels
    ViewListOptions views;                      ///< likewise of many cameras, a bundle each
    /// Rays along the longer side of a bundle, or scene units from ray to ray.
    std::optional<int> resolution;
    std::optional<double> spacing;
    std::optional<Bounds> bounds;  ///< the box that bundles cover; none = the scene's

    /// Whether any rays are asked for.
    bool asksForRays() const {
        return usesCamera() || axes || count || file || !directions.empty();
    }
    bool usesCamera() const {
        return views.asked() || camera.camera || camera.buildsCamera() || camera.intrinsics ||
               camera.near || camera.far || camera.crop;
    }
    RayGrid grid() const;
};

/// Declares --direction … --bounds and the options of addCameraOptions(). What is referred to must
/// outlive the parse.
void addBundleOptions(VerbOptions& verb, BundleOptions& options,
                      SceneReadOptions* reading = nullptr);

/// Throws Error (kUsage) for what contradicts itself whatever the scene is, and if there is nothing
/// to trace.
void checkBundleOptions(const BundleOptions& options);

/// The directions of a text file as unit vectors: three numbers a line, separated by blanks or
/// commas, of any length but 0; empty lines and what follows # do not count. Throws Error (kInput)
/// with the line.
std::vector<glm::dvec3> readDirections(const std::filesystem::path& file);

/// All bundles but a camera's, in the order of the options, those of the axes last. `scene` bounds
/// all that is to be hit. Throws like parallelBundle() and readDirections().
std::vector<Bundle> parallelBundles(const BundleOptions& options, const Bounds& scene);

}  // namespace peeler::cmd
