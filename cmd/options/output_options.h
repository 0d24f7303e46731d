// SPDX-License-Identifier: Apache-2.0
// What verbs that write a picture share: where it goes, in which form, and what is said about it.
#pragma once

#include <filesystem>
#include <set>
#include <span>
#include <string>
#include <string_view>
#include <vector>

#include "cmd/cli/choices.h"
#include "cmd/cli/console.h"
#include "cmd/cli/report.h"
#include "core/image/sink.h"
#include "core/scene/scene.h"
#include "formats/exr/exr_files.h"
#include "formats/writers.h"

namespace peeler::cmd {

class VerbOptions;

/// An output file on the command line.
struct OutputFlags {
    std::filesystem::path path;
    bool no_clobber = false;
    OutputOptions options;  ///< but its provenance
    /// "--exposure": of the options of which only some formats have a use, those that are given.
    std::set<std::string_view> given;

    bool isGiven(std::string_view option) const { return given.contains(option); }
    /// Whether something is asked for that layers, which stay as they were rendered, do not have.
    bool asksForDisplay() const;
    /// The options, of a picture that comes from there.
    OutputOptions from(const Provenance& provenance) const;
};

/// Declares -o and --no-clobber; with `layers_only` for a verb that writes no composites.
void addOutputFile(VerbOptions& verb, OutputFlags& flags, bool layers_only = false);
/// Declares those and --background, --exposure and --tone-map.
void addOutputOptions(VerbOptions& verb, OutputFlags& flags);
/// Declares --as, --no-composite and those of layer files (--layout, --compression, --deep-merge,
/// --deep-z-tolerance, --deep-alpha-tolerance), for verbs that have layers to write.
void addLayerOutputOptions(VerbOptions& verb, OutputFlags& flags, bool layers_only = false);

/// Declares --fxaa; `remark` ends its description.
void addFxaaOption(VerbOptions& verb, bool& fxaa, const std::string& remark);

/// Throws before any work is done: Error (kUsage) if the path names no format, an option does not
/// apply to it or the output is one of the inputs; (kOutput) if the folder cannot be written to, or
/// the file is there and must stay.
void checkOutput(const OutputFlags& flags, const std::vector<std::filesystem::path>& inputs);
/// What of it can be told from the options alone: that they apply to the format, and have what they
/// need.
void checkFormat(const OutputFlags& flags);
/// What of it depends on the file's name alone: not to replace what must stay; of the layout
/// "per-file", no file of the set.
void checkTarget(const OutputFlags& flags, const std::vector<std::filesystem::path>& inputs);
/// What --no-clobber asks for: throws Error (kOutput) if anything has that name.
void checkNotThere(const std::filesystem::path& file);
/// What of it depends on the folder: that it takes a new file. Nothing of that stays.
void checkFolder(const std::filesystem::path& file);

/// checkTarget for every file of a series: flags.path with each number in it as framePath does it,
/// or itself if it has no place for one. Returns their names.
std::vector<std::filesystem::path> checkSeries(const OutputFlags& flags,
                                               std::span<const int> numbers,
                                               const std::vector<std::filesystem::path>& inputs);

/// Whether an output made of `input` is to have Cryptomatte layers: the input has them, and a
/// composite is written. They are made anew of the ids.
bool keepsCryptomatte(const ExrInfo& input, const OutputFlags& output);

/// Fills in what the finished files themselves tell: their bytes, and layers and fragments if
/// samples were merged, of which the plan knows nothing. `result` has the layers of the plan. Warns
/// if files of layers beyond them are left of another picture of that name.
void describeFiles(const OutputFlags& flags, PictureResult& result, Console& console);

/// Throws like checkOutput if another file that a verb writes (`what`, by `option`) cannot be
/// written, or would replace one of the others.
void checkExtraFile(const std::filesystem::path& file,
                    const std::vector<std::filesystem::path>& others, const std::string& what,
                    const std::string& option);

/// Throws like checkOutput if the report cannot be written, or would replace one of the others.
void checkReport(const ReportOptions& options, const std::vector<std::filesystem::path>& others);

/// Throws Error (kUsage) if one of `outputs` (a report, too) is a file that the scene is made of:
/// Scene::files, which are known only when it has been read. Nothing may have been written yet.
void checkSceneFiles(const Scene& scene, const std::vector<std::filesystem::path>& outputs);

/// Declares --threads; 0 = allowedThreads() (cmd/machine/resources.h).
void addThreadsOption(VerbOptions& verb, int& threads);

}  // namespace peeler::cmd
