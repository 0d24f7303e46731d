// SPDX-License-Identifier: Apache-2.0
// The options of peeler render.
#pragma once

#include <filesystem>
#include <memory>
#include <optional>
#include <string>
#include <vector>

#include "cmd/options/camera_options.h"
#include "cmd/options/capture_job.h"
#include "cmd/options/clip_options.h"
#include "cmd/options/output_options.h"
#include "cmd/options/sequence_options.h"
#include "cmd/options/view_options.h"
#include "cmd/render/channel_options.h"
#include "cmd/render/sample_shards.h"

namespace peeler::cmd {

class VerbOptions;

/// All options of peeler render; captureSettings() adapts `capture` to the output.
struct RenderOptions : CaptureJobOptions {
    std::vector<std::filesystem::path> scenes;  ///< files, folders and globs of files
    CameraOptions camera;                       ///< of many views what is the same for all
    ViewListOptions views;
    ChannelOptions channels;
    ClipOptions clip;
    std::optional<int> shadow_size;
    bool fxaa = false;
    bool samples_given = false;  ///< --samples is on the command line
    std::optional<std::string> preset;
    OutputRequest output;
    ShardOptions shard;
    std::shared_ptr<SampleShards> shards;  ///< if the output is one; it has the scenes of a run
    SequenceOptions sequence;

    /// Whether `scenes` is one file, and so neither a folder nor a glob.
    bool isOneScene() const;
};

/// Declares all options of the verb. `options` must outlive the parse.
void addRenderOptions(VerbOptions& verb, RenderOptions& options);

/// Samples a pixel of composites for eyes.
inline constexpr int kDisplaySamples = 4;

/// What to capture for the output that was asked for: of composites for eyes kDisplaySamples unless
/// the number is given, or FXAA smooths their edges. Throws Error (kUsage) for what contradicts
/// itself whatever the scene is.
CaptureSettings captureSettings(const RenderOptions& options);

}  // namespace peeler::cmd
