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

/// The reaction to solids that rays enter but do not leave.
enum class ParityUse : std::uint8_t { kReport, kFail };

/// All options of peeler rays. `appearance` uses only the variant.
struct RaysOptions : CaptureJobOptions {
    BundleOptions bundles;
    std::optional<Faces> faces;  ///< none = chosenFaces()
    bool refine = true;
    bool double_points = false;
    std::vector<std::string> columns;  ///< hit columns, in the order of hitColumns(); empty = all
    /// A file of query points. Requests their next hits instead of all hits.
    std::optional<std::filesystem::path> points;
    /// Cells along the longest side of a lattice.
    std::optional<int> voxels;
    std::optional<ParityUse> parity;
    RayMapFlags maps;
    OutputRequest output;
    SequenceOptions sequence;

    /// Whether an output needs the interior of solids.
    bool asksForInside() const;
    /// Returns the given faces, else both; for a camera's pixels, the default of pictures, so that
    /// the hits match a picture from the same camera.
    Faces chosenFaces() const;
    bool writesFile() const { return !output.path.empty(); }
    bool writesPictures() const { return !maps.maps.empty(); }
    /// Returns the input files besides the scene's.
    std::vector<std::filesystem::path> inputs() const;
};

/// Declares all options of the verb. `options` must outlive the parse.
void addRaysOptions(VerbOptions& verb, RaysOptions& options);

/// Throws Error (kUsage) if the options contradict each other, regardless of the scene.
void checkRaysOptions(const RaysOptions& options);

/// Returns the options that change hits or their outputs, for the settings hash. `bundles` are the
/// traced bundles, whichever options they come from. The content of the --points file counts as
/// input, like the scene.
nlohmann::json raySettings(const RaysOptions& options, std::span<const Bundle> bundles);

/// Throws Error (kMemory) if the data kept for a lattice's cells exceed the budget.
void checkVoxelMemory(const AxisBundles& lattice, const MemoryBudget& memory);

}  // namespace peeler::cmd
