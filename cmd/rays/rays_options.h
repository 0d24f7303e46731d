// SPDX-License-Identifier: Apache-2.0
// The options of peeler rays: which bundles, which maps, and what contradicts itself.
#pragma once

#include <cstdint>
#include <filesystem>
#include <glm/glm.hpp>
#include <nlohmann/json_fwd.hpp>
#include <optional>
#include <span>
#include <string>
#include <utility>
#include <vector>

#include "cmd/options/camera_options.h"
#include "cmd/options/capture_job.h"
#include "cmd/options/output_options.h"
#include "cmd/options/sequence_options.h"
#include "cmd/options/view_options.h"
#include "core/base/memory_budget.h"
#include "core/rays/bundle.h"
#include "core/scene/posed_scene.h"
#include "formats/rays/ray_output.h"

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
        return views.asked() || camera.camera || camera.buildsCamera() || camera.near ||
               camera.far || camera.crop;
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

/// Which maps of rays, and what they need to know.
struct RayMapFlags {
    std::vector<RayMap> maps;  ///< none: hits are written
    /// Of materials, per scene unit, by a glob of their names or an index.
    std::vector<std::pair<std::string, double>> attenuation;
    std::vector<std::string> parts;  ///< globs of node names
    std::optional<std::pair<double, double>> range;
    bool legend = true;
};

/// Declares --map, --attenuation, --part and --range. `flags` must outlive the parse.
void addRayMapOptions(VerbOptions& verb, RayMapFlags& flags);

/// Throws Error (kUsage) for what contradicts itself whatever the scene is.
void checkRayMapFlags(const RayMapFlags& flags);

/// What the maps need, of this scene. Throws Error (kUsage) for a material or a node that the scene
/// does not have.
RayMapOptions rayMapOptions(const RayMapFlags& flags, const Scene& scene);

/// What becomes of solids that rays enter and do not leave.
enum class ParityUse : std::uint8_t { kReport, kFail };

/// All options of peeler rays; of `appearance` the variant alone.
struct RaysOptions : CaptureJobOptions {
    BundleOptions bundles;
    std::optional<Faces> faces;  ///< none = chosenFaces()
    bool refine = true;
    bool double_points = false;
    std::vector<std::string> columns;  ///< of hits, in the order of hitColumns(); none = all
    /// A file of points of which the next hits are asked for, not all hits.
    std::optional<std::filesystem::path> points;
    /// Cells along the longest side of a lattice.
    std::optional<int> voxels;
    std::optional<ParityUse> parity;
    RayMapFlags maps;
    OutputRequest output;
    SequenceOptions sequence;

    /// Whether something depends on what is inside of surfaces.
    bool asksForInside() const;
    /// The faces that are given; else both, but for the pixels of a camera, which have the hits
    /// that a picture of the same camera has.
    Faces chosenFaces() const;
    bool writesFile() const { return !output.path.empty(); }
    bool writesPictures() const { return !maps.maps.empty(); }
    /// The files that are read, besides those that the scene is made of.
    std::vector<std::filesystem::path> inputs() const;
};

/// Declares all options of the verb. `options` must outlive the parse.
void addRaysOptions(VerbOptions& verb, RaysOptions& options);

/// Throws Error (kUsage) for what contradicts itself whatever the scene is.
void checkRaysOptions(const RaysOptions& options);

/// What of the options changes hits or what is made of hits, for the settings' hash: `bundles` as
/// they are traced, whichever options they come from. What is in the file of --points is input, as
/// the scene is.
nlohmann::json raySettings(const RaysOptions& options, std::span<const Bundle> bundles);

/// Throws Error (kMemory) if what is kept of the cells of a lattice does not fit into the budget.
void checkVoxelMemory(const AxisBundles& lattice, const MemoryBudget& memory);

}  // namespace peeler::cmd
