// SPDX-License-Identifier: Apache-2.0
// What verbs that capture a scene have in common: the scene they open, the device they choose, the
// time they take, and what they report of it.
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

/// What every verb that captures a scene is asked for.
struct CaptureJobOptions {
    SceneOptions scene;
    AnimationOptions animation;
    AppearanceOptions appearance;
    CaptureSettings capture;  ///< as options say it; a verb adjusts a copy
    gl::ContextRequest device;
    RayEngine engine = RayEngine::kAuto;  ///< of verbs that trace rays
    int threads = 0;
    ReportOptions report;
};

/// Sets what pictures for eyes get, unless it is asked for otherwise on the command line: larger
/// points, and the studio where nothing else would light the scene. Shadows, and what is seen from
/// a light, need the built-in light.
void chooseForEyes(const VerbOptions& verb, const CameraOptions& camera,
                   CaptureJobOptions& options);

/// Declares SCENE, an argument.
void addSceneArgument(VerbOptions& verb, CaptureJobOptions& options);
/// Declares the options of addSceneOptions() and addTimeOptions().
void addShownOptions(VerbOptions& verb, CaptureJobOptions& options);
/// Declares the options of addMachineOptions() and addReportOptions(); `memory` says how a verb
/// keeps to --memory.
void addRunOptions(VerbOptions& verb, CaptureJobOptions& options,
                   const std::string& memory = "the picture is rendered in bands that fit");

/// One run over one scene, from options to a result, stage after stage: checkOptions(),
/// openScene(), checkOutputs(), openRenderer() or openHits(), finish().
class CaptureJob {
  public:
    using Clock = std::chrono::steady_clock;

    /// Begins the run; from here on the reporter is as quiet as it was asked to be. Options and
    /// session must outlive the job.
    CaptureJob(const CaptureJobOptions& options, Session& session);
    ~CaptureJob();
    CaptureJob(const CaptureJob&) = delete;
    CaptureJob& operator=(const CaptureJob&) = delete;

    /// Throws Error (kUsage) for what contradicts itself whatever the scene is; sets the threads.
    void checkOptions() const;

    /// Reads the scene, as OpenedScene does. It lives as long as the job.
    const OpenedScene& openScene();
    /// Throws like checkSceneFiles() if `outputs`, or the report, would replace a file of the
    /// scene.
    void checkOutputs(std::vector<std::filesystem::path> outputs) const;
    /// The scene at the time that was asked for.
    PosedScene pose();

    /// Opens a context as gl::createContext() does, throwing like it, and uploads the scene, unless
    /// the session has both. Notes once that it renders in software, unless that was asked for.
    GlRenderer& openRenderer(const PosedScene& posed);
    /// The run needs it no longer; what the session does not keep is closed.
    void releaseRenderer();
    /// Closes the context, which may be lost, and everything in it.
    void closeContext();
    /// The open GlRenderer, or null. The context may be there without it, if the scene had no room.
    GlRenderer* renderer() { return renderer_; }
    bool hasContext() const { return session_.hasContext(); }
    const gl::Device& device() const { return *device_; }  ///< of the GlRenderer opened last

    /// The engine that finds the hits of this run, kCpu or kGl: the one that was asked for, or what
    /// `auto` comes to here, which is found out once and noted for those who want to know.
    RayEngine chooseEngine();
    /// Opens what finds the hits of the scene by that engine: the rasteriser on the CPU, with
    /// nothing of GL, or as openRenderer() does, throwing like it. What is open already is used
    /// again.
    HitSource& openHits(const PosedScene& posed);
    /// releaseRenderer() of either engine.
    void releaseHits();
    /// Closes what a failure may have left in any state, with the times that belong to no result.
    void discard();

    /// The exposure in stops that the light of the scene asks for (ExposureMeter), of the open
    /// GlRenderer. It is metered on a small picture of all that the camera sees, whatever part is
    /// asked for, with a sample a pixel and by the first method, so that tiles and crops agree; of
    /// frames at the beginning, in the middle and at the end of what moves the scene, whichever
    /// frames are asked for, so that they agree, too; of many cameras by the first, the middle and
    /// the last. Leaves the GlRenderer in another pose. Throws
    /// like GlRenderer::capture().
    float meterExposure(const CaptureSettings& capture, std::span<const CameraOptions> cameras);

    Clock::time_point start() const { return start_; }
    /// The time of the next result begins now.
    void restartClock() { start_ = Clock::now(); }
    /// What stages have taken, in milliseconds; a verb adds its own.
    StageTimes& times() { return times_; }
    /// The times and those of what is open, since the last call.
    StageTimes takeTimes();

    /// wantsTint() of the options.
    bool wantsTint(const PosedScene& posed) const;

    /// settingsText() of the opened scene, of how it looks, and of the engine that finds hits if it
    /// is not GL (once it is chosen): at edges engines find others. `crop` and `frames_per_second`
    /// are as in ShownScene.
    std::string settingsText(const CaptureSettings& capture, nlohmann::json more,
                             const Window& crop = {}, double frames_per_second = 0) const;
    /// Likewise settingsHash().
    std::string settingsHash(const CaptureSettings& capture, nlohmann::json more,
                             const Window& crop = {}) const;

    /// Fills in what every verb reports alike: the input, the engine and the device if there was
    /// one, the memory, and takeTimes() with the run's total, which ends here.
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
