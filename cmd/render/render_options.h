// SPDX-License-Identifier: Apache-2.0
// The options of peeler render.
#pragma once

#include <optional>

#include "cmd/options/animation_options.h"
#include "cmd/options/camera_options.h"
#include "cmd/options/capture_options.h"
#include "cmd/options/channel_options.h"
#include "cmd/options/clip_options.h"
#include "cmd/options/look_options.h"
#include "cmd/options/output_options.h"
#include "cmd/options/scene_options.h"
#include "core/capture/renderer.h"

namespace peeler::cmd {

/// How a run over many pictures meets what is there already, and what fails.
struct SequenceOptions {
    bool skip_existing = false;
    bool keep_going = false;
    bool dry_run = false;
};

struct RenderOptions {
    SceneOptions scene;
    AnimationOptions animation;
    CameraOptions camera;
    CaptureSettings capture;  ///< as declared: see captureSettings()
    ChannelOptions channels;
    ClipOptions clip;
    LookOptions look;
    std::optional<int> shadow_size;
    gl::ContextRequest device;
    int threads = 0;
    bool strict = false;
    bool fxaa = false;
    OutputFlags output;
    SequenceOptions sequence;
    ReportOptions report;
};

/// Declares all of them. `options` must outlive the parse.
void addRenderOptions(VerbOptions& verb, RenderOptions& options);

/// What to capture for the output that was asked for. Throws Error (kUsage) for what contradicts
/// itself whatever the scene is.
CaptureSettings captureSettings(const RenderOptions& options);

}  // namespace peeler::cmd
