// SPDX-License-Identifier: Apache-2.0
// The options of peeler rays.
#pragma once

#include <cstdint>
#include <filesystem>
#include <nlohmann/json_fwd.hpp>
#include <optional>
#include <span>
#include <string>
#include <utility>
#include <vector>

#include <peeler/bundle.h>
#include <peeler/memory_budget.h>
#include "cmd/options/capture_job.h"
#include "cmd/options/output_options.h"
#include "cmd/options/sequence_options.h"
#include "cmd/rays/bundle_options.h"
#include "cmd/rays/ray_map_options.h"
#include "core/scene/posed_scene.h"
#include "formats/rays/ray_output.h"

namespace peeler::cmd {

class VerbOptions;

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
