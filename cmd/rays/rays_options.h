// SPDX-License-Identifier: Apache-2.0
// The options of peeler rays, and which of them contradict each other.
#pragma once

#include <cstdint>
#include <filesystem>
#include <optional>

#include "cmd/options/animation_options.h"
#include "cmd/options/look_options.h"
#include "cmd/options/output_options.h"
#include "cmd/options/scene_options.h"
#include "cmd/rays/bundle_options.h"
#include "cmd/rays/ray_map_options.h"
#include "core/base/memory_budget.h"
#include "core/capture/capture_settings.h"
#include "core/gl/context.h"
#include "core/rays/bundle.h"

namespace peeler::cmd {

/// What becomes of solids that rays enter and do not leave.
enum class ParityUse : std::uint8_t { kReport, kFail };
struct RaysOptions {
    SceneOptions scene;
    AnimationOptions animation;
    LookOptions look;  ///< the variant alone
    BundleOptions bundles;
    CaptureSettings capture;
    bool refine = true;
    bool double_points = false;
    std::optional<std::filesystem::path> points;
    std::optional<int> voxels;
    std::optional<ParityUse> parity;
    RayMapFlags maps;
    gl::ContextRequest device;
    int threads = 0;
    OutputFlags output;
    ReportOptions report;

    bool writesFile() const { return !output.path.empty(); }
    bool writesPictures() const { return !maps.maps.empty(); }
};

/// Declares all options of the verb. `options` must outlive the parse.
void addRaysOptions(VerbOptions& verb, RaysOptions& options);

/// Throws Error (kUsage) for what contradicts itself whatever the scene is.
void checkRaysOptions(const RaysOptions& options);

/// Throws Error (kMemory) if the cells, a byte each, are more than all that may be taken.
void checkVoxelMemory(const AxisBundles& lattice, const MemoryBudget& memory);

}  // namespace peeler::cmd
