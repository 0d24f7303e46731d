// SPDX-License-Identifier: Apache-2.0
// Output options of verbs that write a picture.
#pragma once

#include <filesystem>
#include <set>
#include <span>
#include <string>
#include <string_view>
#include <vector>

#include <peeler/scene.h>
#include <peeler/sink.h>
#include "cmd/cli/report.h"
#include "cmd/session/choices.h"
#include "cmd/session/reporter.h"
#include "formats/exr/exr_files.h"
#include "formats/writers.h"

namespace peeler::cmd {

struct SequenceOptions;
class VerbOptions;

struct OutputRequest {
    std::filesystem::path path;
    bool no_clobber = false, no_mkdir = false;
    OutputOptions options;  ///< without `provenance`
    /// The options that are given and apply only to some formats ("--exposure").
    std::set<std::string_view> given;

    bool isGiven(std::string_view option) const { return given.contains(option); }
    /// Whether the layout is "per-file".
    bool hasFilePerLayer() const;
    /// Whether --background, --exposure or --tone-map is given. These options do not apply to
    /// layers.
    bool asksForDisplay() const;
    /// Whether the file is a display picture and --exposure is not given.
    bool leavesExposureOpen() const;
    /// Returns `options` with this provenance. For display pictures, sets the first tone map unless
    /// --tone-map is given, and a new object as `outcome`.
    OutputOptions from(const Provenance& provenance) const;
};

/// Declares -o, --no-clobber and --no-mkdir. If `layers_only`, the help omits the formats for
/// composites.
void addOutputFile(VerbOptions& verb, OutputRequest& output, bool layers_only = false);
void addDisplayOptions(VerbOptions& verb, OutputRequest& output);
/// Declares the options of addOutputFile() and addDisplayOptions().
void addOutputOptions(VerbOptions& verb, OutputRequest& output);
/// Declares the options of verbs that can write layers: --as, --no-composite, --layout,
/// --compression, --deep-merge, --deep-z-tolerance, --deep-alpha-tolerance, --deep-error,
/// --deep-keep and, unless `layers_only`, the options of addDenseOptions() and --compress.
void addLayerOutputOptions(VerbOptions& verb, OutputRequest& output, bool layers_only = false);

/// Copies the display transform of a display picture from `written.outcome` to `result`.
void describeDisplay(const OutputOptions& written, bool automatic_exposure, PictureResult& result);
/// Prints notes about automatic changes: metered exposure, and raised alpha in more than a
/// hundredth of the pixels.
void noteDisplay(const PictureResult& result, Reporter& reporter);

/// Declares --fxaa. `remark` is the end of the help text.
void addFxaaOption(VerbOptions& verb, bool& fxaa, const std::string& remark);

/// The part of checkOutput() about the options: throws if an option does not apply to the format or
/// needs another option.
void checkFormat(const OutputRequest& output);

/// Whether an output made from `input` gets Cryptomatte layers, which are rebuilt from the ids.
/// Requires Cryptomatte layers in the input and a composite in the output.
bool keepsCryptomatte(const ExrInfo& input, const OutputRequest& output);

/// Sets the total size of the finished files. If samples were merged, also sets the numbers of
/// layers and fragments, which then differ from the plan. `result` must have the plan's layers.
/// Warns if layer files from an earlier run remain under this name. Throws Error (kOutput) if a
/// file is missing.
void describeFiles(const OutputRequest& output, PictureResult& result, Reporter& reporter);

/// Declares --threads; 0 = allowedThreads() (cmd/machine/resources.h).
void addThreadsOption(VerbOptions& verb, int& threads);

}  // namespace peeler::cmd
