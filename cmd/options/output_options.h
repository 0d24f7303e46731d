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

/// The output that the command line requests.
struct OutputRequest {
    std::filesystem::path path;
    bool no_clobber = false, no_mkdir = false;
    OutputOptions options;  ///< `provenance` is not set
    /// Options that apply only to some formats ("--exposure") and were given.
    std::set<std::string_view> given;

    bool isGiven(std::string_view option) const { return given.contains(option); }
    /// Whether --layout asks for a separate file per layer.
    bool hasFilePerLayer() const;
    /// Whether --background, --exposure or --tone-map is given. These do not apply to layers, which
    /// are stored as rendered.
    bool asksForDisplay() const;
    /// Whether the file is a display picture and no exposure is given.
    bool leavesExposureOpen() const;
    /// Returns the options completed by a picture's provenance. For display pictures, the tone map
    /// defaults to the first one, and `outcome` is an object to be filled in.
    OutputOptions from(const Provenance& provenance) const;
};

/// Declares -o, --no-clobber and --no-mkdir. `layers_only`: the verb does not write composites, so
/// the help omits the formats for composites.
void addOutputFile(VerbOptions& verb, OutputRequest& output, bool layers_only = false);
/// Declares the options of addOutputFile(), and also --background, --exposure and --tone-map.
void addOutputOptions(VerbOptions& verb, OutputRequest& output);
/// For verbs that can write layers, declares --as, --no-composite and the options for layer files
/// (--layout, --compression, --deep-merge, --deep-z-tolerance, --deep-alpha-tolerance) and, unless
/// `layers_only`, those of addDenseOptions().
void addLayerOutputOptions(VerbOptions& verb, OutputRequest& output, bool layers_only = false);

/// Fills in the display transform of a display picture, from `written.outcome`. Does nothing for
/// other files.
void describeDisplay(const OutputOptions& written, bool automatic_exposure, PictureResult& result);
/// Prints notes about automatic changes: a metered exposure, and alpha that was raised in more than
/// a hundredth of the pixels.
void noteDisplay(const PictureResult& result, Reporter& reporter);

/// Declares --fxaa; `remark` is the end of its help text.
void addFxaaOption(VerbOptions& verb, bool& fxaa, const std::string& remark);

/// Does the part of checkOutput() that depends on the options alone: whether they apply to the
/// format and their prerequisites are met.
void checkFormat(const OutputRequest& output);

/// Whether an output made from `input` gets Cryptomatte layers, which are rebuilt from the ids. It
/// does if the input has them and a composite is written.
bool keepsCryptomatte(const ExrInfo& input, const OutputRequest& output);

/// Fills in properties of the finished files: the total size and, if samples were merged, the
/// layers and fragments, which the plan does not have then. `result` must have the layers of the
/// plan. Warns if further layer files from an earlier run remain under this name. Throws Error
/// (kOutput) if a file is missing.
void describeFiles(const OutputRequest& output, PictureResult& result, Reporter& reporter);

/// Declares --threads; 0 = allowedThreads() (cmd/machine/resources.h).
void addThreadsOption(VerbOptions& verb, int& threads);

}  // namespace peeler::cmd
