// SPDX-License-Identifier: Apache-2.0
// Capture job: scene, device, timing and report of a verb that captures a scene.
#pragma once

#include <chrono>
#include <filesystem>
#include <memory>
#include <nlohmann/json.hpp>
#include <optional>
#include <span>
#include <string>
#include <vector>

#include "cmd/cli/report.h"
#include "cmd/options/animation_options.h"
#include "cmd/options/appearance_options.h"
#include "cmd/options/camera_options.h"
#include "cmd/options/capture_options.h"
#include "cmd/options/scene_options.h"
#include "cmd/session/session.h"
#include "cmd/session/settings_text.h"
#include "core/capture/gl_renderer.h"
#include "core/scene/posed_scene.h"

namespace peeler::cmd {

/// Options common to verbs that capture a scene.
struct CaptureJobOptions {
    SceneOptions scene;
    AnimationOptions animation;
    AppearanceOptions appearance;
    CaptureSettings capture;  ///< from the options; a verb adjusts a copy
    gl::ContextRequest device;
    RayEngine engine = RayEngine::kAuto;  ///< for verbs that trace rays
    int threads = 0;
    ReportOptions report;
};

/// Sets defaults for display pictures that the command line does not override: larger points, and
/// the studio if the scene has no light. Shadows and cameras at lights need the built-in light
/// instead.
void chooseForEyes(const VerbOptions& verb, const CameraOptions& camera,
                   CaptureJobOptions& options);

/// Declares the positional argument SCENE.
void addSceneArgument(VerbOptions& verb, CaptureJobOptions& options);
/// Declares the options of addSceneOptions() and addTimeOptions().
void addShownOptions(VerbOptions& verb, CaptureJobOptions& options);
/// Declares the options of addMachineOptions() and addReportOptions(); `memory` describes how the
/// verb stays within --memory.
void addRunOptions(VerbOptions& verb, CaptureJobOptions& options,
                   const std::string& memory = "the picture is rendered in bands that fit");

/// A run over one scene, in stages: checkOptions(), openScene(), checkOutputs(), openRenderer() or
/// openHits(), finish().
class CaptureJob {
  public:
    using Clock = std::chrono::steady_clock;

    /// Begins the run and sets the reporter's verbosity. Options and session must outlive the job.
    CaptureJob(const CaptureJobOptions& options, Session& session);
    ~CaptureJob();
    CaptureJob(const CaptureJob&) = delete;
    CaptureJob& operator=(const CaptureJob&) = delete;

    /// Sets the threads. Throws Error (kUsage) if the options contradict each other, regardless of
    /// the scene.
    void checkOptions() const;

    /// Reads the scene like OpenedScene(). It lives as long as the job.
    const OpenedScene& openScene();
    /// Throws like checkSceneFiles() if `outputs`, or the report, would replace a file of the
    /// scene.
    void checkOutputs(std::vector<std::filesystem::path> outputs) const;
    /// Returns the scene at the requested time.
    PosedScene pose();

    /// Opens a context and uploads the scene unless the session has both. Throws like
    /// gl::createContext(). Notes software rendering once, unless it was requested.
    GlRenderer& openRenderer(const PosedScene& posed);
    /// Releases the renderer; closes everything the session does not keep.
    void releaseRenderer();
    /// Closes the context, possibly lost, and everything in it.
    void closeContext();
    /// Returns the open GlRenderer, or null. There may be a context without a renderer if the scene
    /// did not fit.
    GlRenderer* renderer() { return renderer_; }
    bool hasContext() const { return session_.hasContext(); }
    const gl::Device& device() const { return *device_; }  ///< of the GlRenderer opened last

    /// Returns this run's ray engine, kCpu or kGl: the requested one, or the choice of `auto`,
    /// which is made once and reported as a detail.
    RayEngine chooseEngine();
    /// Opens the hit source of that engine: the CPU rasteriser, without any GL, or openRenderer().
    /// Throws like openRenderer(). Reuses an open source.
    HitSource& openHits(const PosedScene& posed);
    /// Releases the hit source of either engine, like releaseRenderer().
    void releaseHits();
    /// Discards state that a failure may have corrupted, and times that belong to no result.
    void discard();

    /// Meters the exposure in stops (ExposureMeter) with the open GlRenderer. Uses a small picture
    /// of the whole view, regardless of crop and tile, with one sample per pixel and the first
    /// method, so that tiles and crops agree. Meters an animated scene at the beginning, middle and
    /// end of its animations, regardless of the requested frames, so that frames agree. Meters a
    /// list of cameras at the first, middle and last. Leaves the GlRenderer in another pose. Throws
    /// like GlRenderer::capture().
    float meterExposure(const CaptureSettings& capture, std::span<const CameraOptions> cameras);

    Clock::time_point start() const { return start_; }
    /// Starts the time of the next result.
    void restartClock() { start_ = Clock::now(); }
    /// Returns the stage times in milliseconds; a verb adds its own.
    StageTimes& times() { return times_; }
    /// Returns times(), including those of the open sources, since the last call.
    StageTimes takeTimes();

    /// Returns wantsTint() for the options.
    bool wantsTint(const PosedScene& posed) const;

    /// Returns settingsText() for the opened scene, its appearance and, once chosen, a ray engine
    /// other than GL, because engines differ at edges. `crop` and `frames_per_second` are as in
    /// ShownScene.
    std::string settingsText(const CaptureSettings& capture, nlohmann::json more,
                             const Window& crop = {}, double frames_per_second = 0) const;
    /// Returns the settingsHash() of the same.
    std::string settingsHash(const CaptureSettings& capture, nlohmann::json more,
                             const Window& crop = {}) const;

    /// Fills in the results common to all verbs: input, engine, device if any, memory, and
    /// takeTimes() with the run's total, which ends here.
    void finish(RunResult& result);

  private:
    const CaptureJobOptions& options_;
    Session& session_;
    Reporter& reporter_;
    Clock::time_point start_ = Clock::now();
    StageTimes times_;
    SharedScene scene_;
    std::optional<gl::Device> device_;
    GlRenderer* renderer_ = nullptr;   ///< the session's
    std::optional<RayEngine> engine_;  ///< kCpu or kGl, once it is chosen
    std::unique_ptr<HitSource> rasterizer_;
};

}  // namespace peeler::cmd
