// SPDX-License-Identifier: Apache-2.0
// Checks of output files before any work is done.
#pragma once

#include <filesystem>
#include <span>
#include <string>
#include <vector>

#include <peeler/scene.h>
#include "cmd/cli/report.h"
#include "cmd/options/output_options.h"

namespace peeler::cmd {

/// Throws before any work is done: Error (kUsage) if the path names no format, an option does not
/// apply to it or the output is one of the inputs; (kOutput) if the folder can neither be written
/// to nor made, or the file is there and must stay.
void checkOutput(const OutputRequest& output, const std::vector<std::filesystem::path>& inputs);

/// The part of checkOutput() that depends on the file's name: that nothing is replaced that must
/// stay, in the layout "per-file" by no file of the set.
void checkTarget(const OutputRequest& output, const std::vector<std::filesystem::path>& inputs);

/// Throws Error (kOutput) if there is anything of that name, as --no-clobber asks.
void checkNotThere(const std::filesystem::path& file);

/// Throws Error (kOutput) if there is no such folder for the file, as --no-mkdir asks.
void checkFolderIsThere(const std::filesystem::path& folder, const std::filesystem::path& file);

/// The part of checkOutput() that depends on the folder: that it takes a new file, or could be
/// made. Leaves nothing behind.
void checkFolder(const std::filesystem::path& file);

/// checkTarget() for every file of a run, as `output` would have it under that name, and
/// checkFolder() for the first unless a failure does not stop the others. What --no-clobber
/// protects is no error yet where a file that is there may be the one that is wanted.
void checkTargets(OutputRequest output, std::span<const std::filesystem::path> files,
                  const SequenceOptions& options, const std::vector<std::filesystem::path>& inputs);

/// checkTarget() for every file of a series: `output.path` with each number in it, as framePath()
/// does it, or itself if it has no place for one. Returns their names.
std::vector<std::filesystem::path> checkSeries(const OutputRequest& output,
                                               std::span<const int> numbers,
                                               const std::vector<std::filesystem::path>& inputs);

/// Throws like checkOutput() if another file that a verb writes (`what`, by `option`) cannot be
/// written, or would replace one of `others`.
void checkExtraFile(const std::filesystem::path& file,
                    const std::vector<std::filesystem::path>& others, const std::string& what,
                    const std::string& option);

/// Throws like checkOutput() if the report cannot be written, or would replace one of `others`.
void checkReport(const ReportOptions& options, const std::vector<std::filesystem::path>& others);

/// Throws Error (kUsage) if one of `outputs` (a report, too) is a file that the scene is made of:
/// Scene::files, which are known only when it has been read. Nothing may have been written yet.
void checkSceneFiles(const Scene& scene, const std::vector<std::filesystem::path>& outputs);

}  // namespace peeler::cmd
