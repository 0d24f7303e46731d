// SPDX-License-Identifier: Apache-2.0
// How layers are laid out in files: layouts, compression, and which deep samples become one.
#pragma once

#include <cstdint>
#include <filesystem>
#include <optional>
#include <string>
#include <vector>

#include "cmd/console.h"
#include "cmd/report.h"
#include "core/deep_merge.h"
#include "formats/writers.h"

namespace CLI {
class App;
}

namespace peeler::cmd {

struct LayerFileFlags {
    std::optional<std::string> layout;       ///< a name in exrLayouts()
    std::optional<std::string> compression;  ///< a name in exrCompressions()
    DeepMerge deep_merge = DeepMerge::kOff;
    std::optional<double> z_tolerance, alpha_tolerance;
};

/// Declares --layout, --compression, --deep-merge, --deep-z-tolerance and --deep-alpha-tolerance.
void addLayerFileOptions(CLI::App& app, LayerFileFlags& flags);

/// Throws Error (kUsage) if one of them does not apply to `format`, or lacks another.
void checkLayerFileOptions(const LayerFileFlags& flags, const OutputFormat& format);

/// Throws Error (kUsage) if a file of a set would replace an input; (kOutput) with `no_clobber` if
/// a file of a set is there already.
void checkLayerFiles(const LayerFileFlags& flags, const std::filesystem::path& output,
                     const std::vector<std::filesystem::path>& inputs, bool no_clobber);

/// Fills in what the format's writer is told.
void applyLayerFileOptions(const LayerFileFlags& flags, OutputOptions& options);

/// Layers and fragments of a finished file as they are in it, if samples were merged: the plan
/// knows of none.
void countMerged(const LayerFileFlags& flags, const std::filesystem::path& output,
                 PictureResult& result);

/// Says so if files of layers beyond the picture's are left of another picture of that name.
void warnOfOtherLayers(const LayerFileFlags& flags, const std::filesystem::path& output,
                       std::size_t layers, Console& console);

/// Bytes of all files that were written for a picture of so many layers.
std::uint64_t bytesWritten(const LayerFileFlags& flags, const std::filesystem::path& output,
                           std::size_t layers);

}  // namespace peeler::cmd
