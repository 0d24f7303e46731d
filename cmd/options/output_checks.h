// SPDX-License-Identifier: Apache-2.0
// Checks of outputs before any work is done.
#pragma once

#include <filesystem>
#include <span>
#include <string>
#include <vector>

#include <peeler/scene.h>
#include "cmd/cli/report.h"
#include "cmd/options/output_options.h"

namespace peeler::cmd {

/// Throws Error (kUsage) if the path has no known format, an option does not apply to the format,
/// or the output is one of the inputs. Throws Error (kOutput) if the folder can neither be written
/// nor created, or if the file exists and must not be replaced.
void checkOutput(const OutputRequest& output, const std::vector<std::filesystem::path>& inputs);

/// The part of checkOutput() about file names: throws if an input or, under --no-clobber, any
/// existing file would be replaced. Covers all files of the layout "per-file".
void checkTarget(const OutputRequest& output, const std::vector<std::filesystem::path>& inputs);

/// Implements --no-clobber: throws Error (kOutput) if the file exists.
void checkNotThere(const std::filesystem::path& file);

/// Implements --no-mkdir: throws Error (kOutput) if the file's folder does not exist.
void checkFolderIsThere(const std::filesystem::path& folder, const std::filesystem::path& file);

/// The part of checkOutput() about the folder: throws if the folder neither accepts a new file nor
/// can be created. Leaves no files or folders behind.
void checkFolder(const std::filesystem::path& file);

/// Calls checkTarget() with `output` for every file of a run. Calls checkFolder() for the first
/// file unless the run continues after failures. With --skip-existing, --keep-going or --dry-run,
/// an existing file is not an error here, even under --no-clobber.
void checkTargets(OutputRequest output, std::span<const std::filesystem::path> files,
                  const SequenceOptions& options, const std::vector<std::filesystem::path>& inputs);

/// Calls checkTarget() for every file of a series. Returns the files' names: framePath() of
/// `output.path` for each number, or only `output.path` if it has no number pattern.
std::vector<std::filesystem::path> checkSeries(const OutputRequest& output,
                                               std::span<const int> numbers,
                                               const std::vector<std::filesystem::path>& inputs);

/// Throws like checkOutput() if an additional output file cannot be written or would replace one of
/// `others`. In messages, `what` describes the file, and `option` is the option that names the
/// file.
void checkExtraFile(const std::filesystem::path& file,
                    const std::vector<std::filesystem::path>& others, const std::string& what,
                    const std::string& option);

/// Throws like checkOutput() if the report cannot be written, or would replace one of `others`.
/// Throws Error (kUsage) if both the JSON result and a picture go to standard output.
void checkReport(const ReportOptions& options, const std::vector<std::filesystem::path>& others);

/// Throws Error (kUsage) if one of `outputs` is a file of the scene (Scene::files, known after
/// reading the scene). Must be called before anything is written.
void checkSceneFiles(const Scene& scene, const std::vector<std::filesystem::path>& outputs);

}  // namespace peeler::cmd
