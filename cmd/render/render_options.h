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
#include "cmd/options/lens_options.h"
#include "cmd/options/output_options.h"
#include "cmd/options/sequence_options.h"
#include "cmd/options/view_options.h"
#include "cmd/render/channel_options.h"
#include "cmd/render/sample_shards.h"

namespace peeler::cmd {

class VerbOptions;

/// All options of peeler render. captureSettings() adapts `capture` to the output.
struct RenderOptions : CaptureJobOptions {
    std::vector<std::filesystem::path> scenes;  ///< scene files, folders and globs
    CameraOptions camera;                       ///< camera settings common to all views
    LensOptions lens;                           ///< of `camera`, and of views around the scene
    ViewListOptions views;
    ChannelOptions channels;
    ClipOptions clip;
    std::optional<int> shadow_size;
    std::optional<ShadePer> shade_per;            ///< none: as the output needs it
    std::optional<SplatBlending> splat_blending;  ///< none: as the output and the scene need it
    bool fxaa = false;
    bool samples_given = false;  ///< whether --samples is on the command line
    std::optional<std::string> preset;
    OutputRequest output;
    ShardOptions shard;
    std::shared_ptr<SampleShards> shards;  ///< shared by all scenes; null without shards
    SequenceOptions sequence;
    /// Number of scenes in the size forecast: all scenes for the first scene, 1 for every other
    /// scene.
    std::size_t scenes_like_this = 1;

    /// Whether `scenes` is a single file.
    bool isOneScene() const;
};

/// Declares all options of the verb. `options` must outlive the parse.
void addRenderOptions(VerbOptions& verb, RenderOptions& options);

/// Returns the capture settings for the requested output. Display composites get kDisplaySamples
/// unless --samples or --fxaa is given. Throws Error (kUsage) if the options contradict each other.
/// Does not need the scene.
CaptureSettings captureSettings(const RenderOptions& options);

}  // namespace peeler::cmd
