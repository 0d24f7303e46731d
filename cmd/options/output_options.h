// SPDX-License-Identifier: Apache-2.0
// What verbs that write a picture share: where it goes, in which form, and what is said about it.
#pragma once

#include <filesystem>
#include <set>
#include <span>
#include <string>
#include <string_view>
#include <vector>

#include "cmd/cli/report.h"
#include "cmd/session/choices.h"
#include "cmd/session/reporter.h"
#include "core/image/sink.h"
#include "core/scene/scene.h"
#include "formats/exr/exr_files.h"
#include "formats/writers.h"

namespace peeler::cmd {

struct SequenceOptions;
class VerbOptions;

/// What the command line says of an output file.
struct OutputRequest {
    std::filesystem::path path;
    bool no_clobber = false, no_mkdir = false;
    OutputOptions options;  ///< without its provenance
    /// The options that are given ("--exposure"), of those that only some formats have a use for.
    std::set<std::string_view> given;

    bool isGiven(std::string_view option) const { return given.contains(option); }
    /// Whether the layers are files of their own (--layout).
    bool hasFilePerLayer() const;
    /// Whether one of the options is given (--background, --exposure, --tone-map) that do not go
    /// with layers, which stay as they were rendered.
    bool asksForDisplay() const;
    /// Whether the file is for eyes, and nothing says how bright it is to be.
    bool leavesExposureOpen() const;
    /// The options with the provenance of a picture. What is for eyes gets the first of the tone
    /// maps unless another is asked for, and an outcome to be filled in.
    OutputOptions from(const Provenance& provenance) const;
};

/// Declares -o, --no-clobber and --no-mkdir. `layers_only` is for a verb that writes no composites:
/// the help lists no formats of theirs.
void addOutputFile(VerbOptions& verb, OutputRequest& output, bool layers_only = false);
/// Declares the options of addOutputFile(), and --background, --exposure and --tone-map.
void addOutputOptions(VerbOptions& verb, OutputRequest& output);
/// Declares --as, --no-composite and the options of layer files (--layout, --compression,
/// --deep-merge, --deep-z-tolerance, --deep-alpha-tolerance) and, unless `layers_only`, those of
/// addDenseOptions(), for verbs that have layers to write.
void addLayerOutputOptions(VerbOptions& verb, OutputRequest& output, bool layers_only = false);

/// Declares --dense, which also chooses the kind "dense" unless --as says another, --fill and
/// --dense-type.
void addDenseOptions(VerbOptions& verb, OutputRequest& output);
/// Throws Error (kUsage) if one of them is given and the output has no planes.
void checkDenseOptions(const OutputRequest& output, bool has_planes);

/// Fills in how a picture for eyes is shown, as its writer has left it in the outcome of `written`.
/// Does nothing for other files.
void describeDisplay(const OutputOptions& written, bool automatic_exposure, PictureResult& result);
/// Notes what nobody asked for: an exposure that was found, alpha that was raised in more than a
/// hundredth of the pixels.
void noteDisplay(const PictureResult& result, Reporter& reporter);

/// Declares --fxaa; `remark` ends its description.
void addFxaaOption(VerbOptions& verb, bool& fxaa, const std::string& remark);

/// Throws before any work is done: Error (kUsage) if the path names no format, an option does not
/// apply to it or the output is one of the inputs; (kOutput) if the folder can neither be written
/// to nor made, or the file is there and must stay.
void checkOutput(const OutputRequest& output, const std::vector<std::filesystem::path>& inputs);
/// The part of checkOutput() that depends on the options alone: that they apply to the format, and
/// have what they need.
void checkFormat(const OutputRequest& output);
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

/// Whether an output made of `input` is to have Cryptomatte layers: the input has them, and a
/// composite is written. They are made anew from the ids.
bool keepsCryptomatte(const ExrInfo& input, const OutputRequest& output);

/// Fills in what the finished files themselves tell: their bytes, and layers and fragments if
/// samples were merged, of which the plan knows nothing. `result` has the layers of the plan. Warns
/// if there are files of more layers under that name, which an earlier picture has left. Throws
/// Error (kOutput) if a file is gone.
void describeFiles(const OutputRequest& output, PictureResult& result, Reporter& reporter);

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

/// Declares --threads; 0 = allowedThreads() (cmd/machine/resources.h).
void addThreadsOption(VerbOptions& verb, int& threads);

}  // namespace peeler::cmd
