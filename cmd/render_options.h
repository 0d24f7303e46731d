// SPDX-License-Identifier: Apache-2.0
// The options of peeler render.
#pragma once

#include <optional>

#include "cmd/animation_options.h"
#include "cmd/camera_options.h"
#include "cmd/capture_options.h"
#include "cmd/channel_options.h"
#include "cmd/clip_options.h"
#include "cmd/look_options.h"
#include "cmd/output_options.h"
#include "cmd/scene_options.h"
#include "cmd/sequence_options.h"
#include "core/renderer.h"

namespace peeler::cmd {

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
    ReportFlags report;
};

/// Declares all of them. `options` must outlive the parse.
void addRenderOptions(VerbOptions& verb, RenderOptions& options);

/// What to capture for the output that was asked for. Throws Error (kUsage) for what contradicts
/// itself whatever the scene is.
CaptureSettings captureSettings(const RenderOptions& options);

}  // namespace peeler::cmd
