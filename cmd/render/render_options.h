// SPDX-License-Identifier: Apache-2.0
// The options of peeler render.
#pragma once

#include <optional>

#include "cmd/options/camera_options.h"
#include "cmd/options/capture_job.h"
#include "cmd/options/channel_options.h"
#include "cmd/options/clip_options.h"
#include "cmd/options/output_options.h"

namespace peeler::cmd {

/// How a run over many pictures meets what is there already, and what fails.
struct SequenceOptions {
    bool skip_existing = false;
    bool keep_going = false;
    bool dry_run = false;
};

/// Of `capture` see captureSettings().
struct RenderOptions : CaptureJobOptions {
    CameraOptions camera;
    ChannelOptions channels;
    ClipOptions clip;
    std::optional<int> shadow_size;
    bool strict = false;
    bool fxaa = false;
    OutputFlags output;
    SequenceOptions sequence;
};

/// Declares all of them. `options` must outlive the parse.
void addRenderOptions(VerbOptions& verb, RenderOptions& options);

/// What to capture for the output that was asked for. Throws Error (kUsage) for what contradicts
/// itself whatever the scene is.
CaptureSettings captureSettings(const RenderOptions& options);

}  // namespace peeler::cmd
