// SPDX-License-Identifier: Apache-2.0
// Which bundles of rays: from options to bundles.
#pragma once

#include <filesystem>
#include <glm/glm.hpp>
#include <optional>
#include <vector>

#include "cmd/options/camera_options.h"
#include "core/rays/bundle.h"
#include "core/scene/posed_scene.h"

namespace peeler::cmd {

class VerbOptions;

struct BundleOptions {
    std::vector<glm::dvec3> directions;         ///< unit vectors, one by one
    std::optional<int> count;                   ///< so many more, evenly
    bool hemisphere = false;                    ///< over the upper half only
    std::optional<std::filesystem::path> file;  ///< still more
    bool axes = false;                          ///< along X, Y and Z, on one lattice
    CameraOptions camera;                       ///< if any of them is given: its pixels' rays
    std::optional<int> resolution;
    std::optional<double> spacing;  ///< scene units
    std::optional<Bounds> bounds;   ///< what bundles cover; none = the scene

    /// Whether any rays are asked for.
    bool asksForRays() const {
        return usesCamera() || axes || count || file || !directions.empty();
    }
    bool usesCamera() const {
        return camera.camera || camera.buildsCamera() || camera.near || camera.far || camera.crop;
    }
    RayGrid grid() const;
};

/// Declares --direction … --bounds and those of the camera. `options` must outlive the parse.
void addBundleOptions(VerbOptions& verb, BundleOptions& options);

/// Throws Error (kUsage) for what contradicts itself whatever the scene is, and if there is nothing
/// to trace.
void checkBundleOptions(const BundleOptions& options);

/// The directions of a text file, three numbers a line, separated by blanks or commas; empty lines
/// and what follows # do not count. Of any length but 0. Throws Error (kInput) with the line.
std::vector<glm::dvec3> readDirections(const std::filesystem::path& file);

/// All bundles but a camera's, in the order of the options, those of the axes last. `scene` bounds
/// all that is to be hit. Throws like parallelBundle() and readDirections().
std::vector<Bundle> parallelBundles(const BundleOptions& options, const Bounds& scene);

}  // namespace peeler::cmd
