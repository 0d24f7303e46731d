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

/// The output request of the command line.
struct OutputRequest {
    std::filesystem::path path;
    bool no_clobber = false, no_mkdir = false;
    OutputOptions options;  ///< without provenance
    /// The given options ("--exposure") that apply only to some formats.
    std::set<std::string_view> given;

    bool isGiven(std::string_view option) const { return given.contains(option); }
    /// Whether each layer is a separate file (--layout).
    bool hasFilePerLayer() const;
    /// Whether --background, --exposure or --tone-map is given. They do not apply to layers, which
    /// stay as rendered.
    bool asksForDisplay() const;
    /// Whether the file is a display picture and no exposure is given.
    bool leavesExposureOpen() const;
    /// Returns the options with a picture's provenance. Display pictures get the first tone map
    /// unless one is given, and an outcome to fill in.
    OutputOptions from(const Provenance& provenance) const;
};

/// Declares -o, --no-clobber and --no-mkdir. `layers_only`: the verb writes no composites, so the
/// help omits their formats.
void addOutputFile(VerbOptions& verb, OutputRequest& output, bool layers_only = false);
/// Declares the options of addOutputFile(), and --background, --exposure and --tone-map.
void addOutputOptions(VerbOptions& verb, OutputRequest& output);
/// Declares --as, --no-composite and the options of layer files (--layout, --compression,
/// --deep-merge, --deep-z-tolerance, --deep-alpha-tolerance) and, unless `layers_only`, those of
/// addDenseOptions(), for verbs that have layers to write.
void addLayerOutputOptions(VerbOptions& verb, OutputRequest& output, bool layers_only = false);

/// Fills in the display transform of a display picture, from the outcome of `written`. Does nothing
/// for other files.
void describeDisplay(const OutputOptions& written, bool automatic_exposure, PictureResult& result);
/// Notes automatic changes: a metered exposure, and alpha raised in more than a hundredth of the
/// pixels.
void noteDisplay(const PictureResult& result, Reporter& reporter);

/// Declares --fxaa; `remark` ends its description.
void addFxaaOption(VerbOptions& verb, bool& fxaa, const std::string& remark);

/// Does the part of checkOutput() that depends on the options alone: they apply to the format, and
/// their prerequisites are met.
void checkFormat(const OutputRequest& output);

/// Whether an output made from `input` gets Cryptomatte layers: the input has them, and a composite
/// is written. They are rebuilt from the ids.
bool keepsCryptomatte(const ExrInfo& input, const OutputRequest& output);

/// Fills in properties of the finished files: their bytes, and layers and fragments if samples were
/// merged (the plan lacks these). `result` has the layers of the plan. Warns if an earlier picture
/// left files of further layers under that name. Throws Error (kOutput) if a file is missing.
void describeFiles(const OutputRequest& output, PictureResult& result, Reporter& reporter);

/// Declares --threads; 0 = allowedThreads() (cmd/machine/resources.h).
void addThreadsOption(VerbOptions& verb, int& threads);

}  // namespace peeler::cmd
