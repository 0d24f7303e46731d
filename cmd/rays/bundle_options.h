// SPDX-License-Identifier: Apache-2.0
// Options for bundles of rays.
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
    std::vector<glm::dvec3> directions;         ///< unit vectors
    std::optional<int> count;                   ///< further directions, evenly over the sphere
    bool hemisphere = false;                    ///< these only over the upper hemisphere
    std::optional<std::filesystem::path> file;  ///< text file with further directions
    bool axes = false;                          ///< along X, Y and Z, on a common lattice
    CameraOptions camera;                       ///< if any option is given: one ray per pixel
    ViewListOptions views;                      ///< several cameras, one bundle each
    /// The density: rays along the longer side of a bundle, or scene units between rays.
    std::optional<int> resolution;
    std::optional<double> spacing;
    std::optional<Bounds> bounds;  ///< the box that bundles cover; none = the scene's bounds

    /// Whether the options request any rays.
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

/// Throws Error (kUsage) if the options contradict each other, regardless of the scene, or request
/// no rays.
void checkBundleOptions(const BundleOptions& options);

/// Reads directions from a text file and normalises them. Each line has three numbers, separated by
/// blanks or commas; the length may be anything but 0. Skips empty lines and comments after #.
/// Throws Error (kInput), with the line, if a line is invalid.
std::vector<glm::dvec3> readDirections(const std::filesystem::path& file);

/// Returns all bundles except those of cameras, in the order of the options, with the axes last.
/// `scene` is the bounding box of everything that can be hit. Throws like parallelBundle() and
/// readDirections().
std::vector<Bundle> parallelBundles(const BundleOptions& options, const Bounds& scene);

}  // namespace peeler::cmd
