// SPDX-License-Identifier: Apache-2.0
// How layers are laid out in files: layouts, compression, and which deep samples become one.
#pragma once

#include <cstdint>
#include <filesystem>
#include <optional>
#include <string>
#include <vector>

#include "cmd/cli/console.h"
#include "cmd/cli/report.h"
#include "core/image/merge.h"
#include "formats/writers.h"

namespace peeler::cmd {

class VerbOptions;

struct LayerFileFlags {
    std::optional<std::string> layout;       ///< a name in exrLayouts()
    std::optional<std::string> compression;  ///< a name in exrCompressions()
    DeepMerge deep_merge = DeepMerge::kOff;
    std::optional<double> z_tolerance, alpha_tolerance;
};

/// Declares --layout, --compression, --deep-merge, --deep-z-tolerance and --deep-alpha-tolerance.
void addLayerFileOptions(VerbOptions& verb, LayerFileFlags& flags);

/// Throws Error (kUsage) if one of them does not apply to `format`, or lacks another.
void checkLayerFileOptions(const LayerFileFlags& flags, const OutputFormat& format);

/// Throws Error (kUsage) if a file of a set would replace an input; (kOutput) with `no_clobber` if
/// a file of a set is there already.
void checkLayerFiles(const LayerFileFlags& flags, const std::filesystem::path& output,
                     const std::vector<std::filesystem::path>& inputs, bool no_clobber);

/// Fills in what the format's writer is told.
void applyLayerFileOptions(const LayerFileFlags& flags, OutputOptions& options);

/// Fills in what the finished files themselves tell: their bytes, and layers and fragments if
/// samples were merged, of which the plan knows nothing. `result` has the layers of the plan. Warns
/// if files of layers beyond them are left of another picture of that name.
void describeFiles(const LayerFileFlags& flags, const std::filesystem::path& output,
                   PictureResult& result, Console& console);

}  // namespace peeler::cmd
