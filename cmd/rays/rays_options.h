// SPDX-License-Identifier: Apache-2.0
// The options of peeler rays, and which of them contradict each other.
#pragma once

#include <cstdint>
#include <filesystem>
#include <nlohmann/json_fwd.hpp>
#include <optional>
#include <span>

#include "cmd/options/capture_job.h"
#include "cmd/options/output_options.h"
#include "cmd/rays/bundle_options.h"
#include "cmd/rays/ray_map_options.h"

namespace peeler::cmd {

/// What becomes of solids that rays enter and do not leave.
enum class ParityUse : std::uint8_t { kReport, kFail };

/// Of `appearance` the variant alone.
struct RaysOptions : CaptureJobOptions {
    BundleOptions bundles;
    bool refine = true;
    bool double_points = false;
    std::optional<std::filesystem::path> points;
    std::optional<int> voxels;
    std::optional<ParityUse> parity;
    RayMapFlags maps;
    OutputFlags output;

    bool writesFile() const { return !output.path.empty(); }
    bool writesPictures() const { return !maps.maps.empty(); }
};

/// Declares all options of the verb. `options` must outlive the parse.
void addRaysOptions(VerbOptions& verb, RaysOptions& options);

/// Throws Error (kUsage) for what contradicts itself whatever the scene is.
void checkRaysOptions(const RaysOptions& options);

/// What of them changes hits or what is made of hits, for the settings' hash: `bundles` as they are
/// traced, whichever options they come from. What is in the file of --points is input, as the scene
/// is.
nlohmann::json raySettings(const RaysOptions& options, std::span<const Bundle> bundles);

}  // namespace peeler::cmd
