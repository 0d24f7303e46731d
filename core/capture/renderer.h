// SPDX-License-Identifier: Apache-2.0
// From a scene and a view to bands of fragments: count, plan, capture.
#pragma once

#include <cstdint>
#include <functional>
#include <memory>
#include <span>
#include <string>

#include "core/base/stage_times.h"
#include "core/capture/capture_settings.h"
#include "core/capture/captured_fragments.h"
#include "core/gl/context.h"
#include "core/image/sink.h"
#include "core/scene/posed_scene.h"
#include "core/scene/view.h"

namespace peeler {

/// What capturing a picture took.
struct CaptureReport {
    int passes = 0;  ///< geometry passes over a band, the count pass not included
    int bands = 0;
    double largest_correction = 0;  ///< of a hit's Z by refining, scene units
};

/// Called from the capturing thread with the share done, 0 to 1, never falling within a picture.
using Progress = std::function<void(double)>;

/// Throws Error (kUsage) for what contradicts itself whatever the scene is: an unknown method, one
/// that makes composites only where layers are asked for, a limit on one that takes all at once, a
/// blended tail of layers.
void checkSettings(const CaptureSettings& settings);

/// Owns the uploaded scene. One Renderer serves any number of views.
class Renderer {
  public:
    /// Uploads the scene. The context must outlive the Renderer. Throws Error (kMemory) if the
    /// driver has no room, (kInput) if a texture is larger than it takes.
    Renderer(gl::Context& context, PosedScene posed);
    ~Renderer();
    Renderer(const Renderer&) = delete;
    Renderer& operator=(const Renderer&) = delete;

    /// Shows the same scene (of the file's `scenes`) in another pose from the next plan() on. Only
    /// what has moved is uploaded anew.
    void setPose(PosedScene posed);

    /// What motion is measured against in the captures to come.
    void setNextFrame(NextFrame next);

    /// The count pass: what capture() will deliver for these arguments. (Several samples have to be
    /// merged for that, too.) `progress` is called with the share of the picture's work, plan() and
    /// capture() together, that is done; capture() goes on from there. Throws like checkSettings(),
    /// and Error (kMemory) if one row does not fit the budget, (kDevice) if the context is lost.
    Plan plan(const View& view, const CaptureSettings& settings, const Progress& progress = {});

    /// Captures what the last plan() promised and hands each band to the sink; once per plan().
    /// With CaptureSettings::composite a band has one fragment in every pixel that has any: the
    /// composite. begin() and finish() of the sink are the caller's. Throws what the sink throws,
    /// and Error (kInternal) if any pixel's fragments differ in number from the count.
    CaptureReport capture(Sink& sink, const Progress& progress = {});

    /// What is captured, and what the keys of fragments stand for.
    const PosedScene& posed() const;

    /// What the stages have taken since the last call.
    StageTimes takeTimes();

  private:
    struct State;
    std::unique_ptr<State> state_;
};

}  // namespace peeler
