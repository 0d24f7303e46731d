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

/// The reaction to a solid that a ray enters and leaves a different number of times.
enum class ParityUse : std::uint8_t { kReport, kFail };

/// All options of peeler rays. Only the variant in `appearance` is used.
struct RaysOptions : CaptureJobOptions {
    BundleOptions bundles;
    std::optional<Faces> faces;  ///< none = the default of chosenFaces()
    bool refine = true;
    bool double_points = false;
    /// Columns of the hit table, in the order of hitColumns(); empty = those by default.
    std::vector<std::string> columns;
    /// A file of query points. If given, the output has the nearest hit before and the nearest hit
    /// after each point along every direction, instead of all hits.
    std::optional<std::filesystem::path> points;
    /// Number of cells along the longest side of the lattice.
    std::optional<int> voxels;
    std::optional<ParityUse> parity;
    std::optional<Overlap> overlap;  ///< none: winding, without a warning
    RayMapFlags maps;
    OutputRequest output;
    SequenceOptions sequence;

    /// Whether an output needs the interior of solids.
    bool asksForInside() const;
    /// Whether a file needs the interior of solids.
    bool writesInside() const;
    /// Whether a file needs hits with Gaussian splats: lists of hits, and maps that need no solids.
    bool writesSplats() const;
    Overlap overlapRule() const { return overlap.value_or(Overlap::kWinding); }
    /// Returns the requested faces, or the default. The default for a camera's rays is that of
    /// pictures, so that the hits match a picture from the same camera. The default for parallel
    /// rays, and for outputs that need the interior, is both faces.
    Faces chosenFaces() const;
    bool writesFile() const { return !output.path.empty(); }
    bool writesPictures() const { return !maps.maps.empty(); }
    /// Returns the input files that the options name.
    std::vector<std::filesystem::path> inputs() const;
};

/// Declares all options of the verb. `options` must outlive the parse.
void addRaysOptions(VerbOptions& verb, RaysOptions& options);

/// Throws Error (kUsage) if the options contradict each other. Does not need the scene.
void checkRaysOptions(const RaysOptions& options);

/// Returns the options that change hits or their outputs, for the settings hash. `bundles` are all
/// traced bundles. Omits the content of the --points file.
nlohmann::json raySettings(const RaysOptions& options, std::span<const Bundle> bundles);

/// Throws Error (kMemory) if the data kept for the cells of a lattice exceeds the budget.
void checkVoxelMemory(const AxisBundles& lattice, const MemoryBudget& memory);

}  // namespace peeler::cmd
