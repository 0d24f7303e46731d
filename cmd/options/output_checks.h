// SPDX-License-Identifier: Apache-2.0
// Output checks made before any work.
#pragma once

#include <filesystem>
#include <span>
#include <string>
#include <vector>

#include <peeler/scene.h>
#include "cmd/cli/report.h"
#include "cmd/options/output_options.h"

namespace peeler::cmd {

/// Throws Error (kUsage) if the path has no known format, an option does not apply to it, or the
/// output is one of the inputs. Throws Error (kOutput) if the folder can neither be written nor
/// created, or the file exists and must stay.
void checkOutput(const OutputRequest& output, const std::vector<std::filesystem::path>& inputs);

/// Does the part of checkOutput() that depends on the file's name: no file that must stay is
/// replaced, by any file of the set in the layout "per-file".
void checkTarget(const OutputRequest& output, const std::vector<std::filesystem::path>& inputs);

/// Throws Error (kOutput) if the file exists, for --no-clobber.
void checkNotThere(const std::filesystem::path& file);

/// Throws Error (kOutput) if the file's folder does not exist, for --no-mkdir.
void checkFolderIsThere(const std::filesystem::path& folder, const std::filesystem::path& file);

/// Does the part of checkOutput() that depends on the folder: it accepts a new file or could be
/// created. Leaves nothing behind.
void checkFolder(const std::filesystem::path& file);

/// Calls checkTarget() for every file of a run, with `output` under that name, and checkFolder()
/// for the first one unless the run continues after failures. An existing file is not an error
/// under --no-clobber if it may be the wanted one.
void checkTargets(OutputRequest output, std::span<const std::filesystem::path> files,
                  const SequenceOptions& options, const std::vector<std::filesystem::path>& inputs);

/// Calls checkTarget() for every file of a series and returns their names: framePath() of
/// `output.path` and each number, or the path itself if it has no number pattern.
std::vector<std::filesystem::path> checkSeries(const OutputRequest& output,
                                               std::span<const int> numbers,
                                               const std::vector<std::filesystem::path>& inputs);

/// Throws like checkOutput() if an additional output file (`what`, given by `option`) cannot be
/// written or would replace one of `others`.
void checkExtraFile(const std::filesystem::path& file,
                    const std::vector<std::filesystem::path>& others, const std::string& what,
                    const std::string& option);

/// Throws like checkOutput() if the report cannot be written, or would replace one of `others`.
void checkReport(const ReportOptions& options, const std::vector<std::filesystem::path>& others);

/// Throws Error (kUsage) if one of `outputs` (including reports) is a file of the scene
/// (Scene::files, known only once it has been read). Call before anything is written.
void checkSceneFiles(const Scene& scene, const std::vector<std::filesystem::path>& outputs);

}  // namespace peeler::cmd
