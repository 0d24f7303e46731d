// SPDX-License-Identifier: Apache-2.0
// What verbs that write a picture share: where it goes, in which form, and what is said about it.
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

/// Fills in how a picture for eyes is shown, as its writer has left it in the outcome of `written`.
/// Does nothing for other files.
void describeDisplay(const OutputOptions& written, bool automatic_exposure, PictureResult& result);
/// Notes what nobody asked for: an exposure that was found, alpha that was raised in more than a
/// hundredth of the pixels.
void noteDisplay(const PictureResult& result, Reporter& reporter);

/// Declares --fxaa; `remark` ends its description.
void addFxaaOption(VerbOptions& verb, bool& fxaa, const std::string& remark);

/// The part of checkOutput() that depends on the options alone: that they apply to the format, and
/// have what they need.
void checkFormat(const OutputRequest& output);

/// Whether an output made of `input` is to have Cryptomatte layers: the input has them, and a
/// composite is written. They are made anew from the ids.
bool keepsCryptomatte(const ExrInfo& input, const OutputRequest& output);

/// Fills in what the finished files themselves tell: their bytes, and layers and fragments if
/// samples were merged, of which the plan knows nothing. `result` has the layers of the plan. Warns
/// if there are files of more layers under that name, which an earlier picture has left. Throws
/// Error (kOutput) if a file is gone.
void describeFiles(const OutputRequest& output, PictureResult& result, Reporter& reporter);

/// Declares --threads; 0 = allowedThreads() (cmd/machine/resources.h).
void addThreadsOption(VerbOptions& verb, int& threads);

}  // namespace peeler::cmd
