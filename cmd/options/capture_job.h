// SPDX-License-Identifier: Apache-2.0
// Capture job: the scene, device, timing and report of a verb that captures a scene.
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

struct CaptureJobOptions {
    SceneOptions scene;
    AnimationOptions animation;
    AppearanceOptions appearance;
    CaptureSettings capture;  ///< as on the command line; each verb adjusts a copy
    gl::ContextRequest device;
    RayEngine engine = RayEngine::kAuto;  ///< used by verbs that trace rays
    int threads = 0;
    ReportOptions report;
};

/// Chooses the studio for display pictures of scenes without lights. Does nothing if shadows, unlit
/// shading or a camera at a light is requested.
void chooseStudio(const CameraOptions& camera, CaptureJobOptions& options);
/// Sets defaults for display pictures: calls chooseStudio(), and makes points larger unless
/// --point-size is given.
void chooseForEyes(const VerbOptions& verb, const CameraOptions& camera,
                   CaptureJobOptions& options);

void addSceneArgument(VerbOptions& verb, CaptureJobOptions& options);
/// Declares the options of addSceneOptions() and addTimeOptions().
void addShownOptions(VerbOptions& verb, CaptureJobOptions& options);
/// Declares the options of addMachineOptions() and addReportOptions(); `memory` is
/// addMemoryOption()'s `remark`.
void addRunOptions(VerbOptions& verb, CaptureJobOptions& options,
                   const std::string& memory = "the picture is rendered in bands that fit");

/// A run with one scene. Its stages are, in this order: checkOptions(), openScene(),
/// checkOutputs(), openRenderer() or openHits(), finish().
class CaptureJob {
  public:
    using Clock = std::chrono::steady_clock;

    /// Begins the run and applies the report options to the reporter. The options and the session
    /// must outlive the job.
    CaptureJob(const CaptureJobOptions& options, Session& session);
    ~CaptureJob();
    CaptureJob(const CaptureJob&) = delete;
    CaptureJob& operator=(const CaptureJob&) = delete;

    /// Sets the number of threads. Throws Error (kUsage) if the options contradict each other. Does
    /// not need the scene.
    void checkOptions() const;

    /// Reads the scene. Throws like OpenedScene(). The returned scene lives as long as the job.
    const OpenedScene& openScene();
    /// Prints a note with the assumed unit if the scene file has no unit. For verbs that report
    /// lengths.
    void noteUnit() const;
    /// Throws like checkSceneFiles() if one of `outputs`, or the report, would replace a file of
    /// the scene.
    void checkOutputs(std::vector<std::filesystem::path> outputs) const;
    PosedScene pose();

    /// Opens a context and uploads the scene, unless the session already has them; a renderer of
    /// this scene that is open takes the pose. Opens no context for splats alone, unless the user
    /// chose a device. Throws like gl::createContext(). Prints a note, once per session, if
    /// rendering is in software and the user did not choose software rendering.
    GlRenderer& openRenderer(const PosedScene& posed);
    /// Releases the renderer, and closes everything that the session does not keep.
    void releaseRenderer();
    /// Closes the context and everything in it. May be called when the context is lost.
    void closeContext();
    /// Returns the open GlRenderer, or null. If the scene did not fit, there is a context, but no
    /// renderer.
    GlRenderer* renderer() { return renderer_; }
    bool hasContext() const { return session_.hasContext(); }
    /// Returns the device of the last opened GlRenderer; null if it needs none.
    const gl::Device* device() const { return device_ ? &*device_ : nullptr; }

    /// Returns the ray engine of this run, kCpu or kGl. If the user did not choose an engine, the
    /// first call chooses it and reports the choice as a detail.
    RayEngine chooseEngine();
    /// Opens the hit source of chooseEngine(): the CPU rasteriser, which needs no GL, or the
    /// GlRenderer. Reuses an open GlRenderer. `splats`: whether bundles hit Gaussian splats; if
    /// not, warns of them. Throws like openRenderer().
    HitSource& openHits(const PosedScene& posed, bool splats = false);
    /// Chooses the CPU, for hits of views that all have View::rays. Throws Error (kUsage) if the
    /// options ask for GL.
    void traceOnCpu();
    /// Opens a hit source that takes only views with View::rays. Needs no engine and no GL.
    HitSource& openTracer(const PosedScene& posed);
    void releaseHits();
    /// Discards state that a failure may have corrupted, and the times of the failed work.
    void discard();

    /// Meters the exposure in stops (ExposureMeter) with the open GlRenderer. All tiles, crops and
    /// frames of a picture must get the same exposure. Therefore, meters a small picture of the
    /// whole view and, for a sequence, the beginning, middle and end of the animations. Uses the
    /// first, middle and last of several cameras, the first method, and one sample per pixel.
    /// Leaves the GlRenderer in a different pose. Throws like GlRenderer::capture().
    float meterExposure(const CaptureSettings& capture, std::span<const CameraOptions> cameras);

    Clock::time_point start() const { return start_; }
    void restartClock() { start_ = Clock::now(); }
    /// Returns the stage times in milliseconds. A verb adds the times of its own stages.
    StageTimes& times() { return times_; }
    /// Returns the sum of times() and the times of the open sources, and resets all of these times.
    StageTimes takeTimes();

    bool wantsTint(const PosedScene& posed) const;

    /// Returns settingsText() for the opened scene and its appearance. Includes the ray engine if
    /// it is the CPU, because the engines' hits differ at edges. `crop` and `frames_per_second` are
    /// as in ShownScene.
    std::string settingsText(const CaptureSettings& capture, nlohmann::json more,
                             const Window& crop = {}, double frames_per_second = 0) const;
    /// Returns settingsHash() for the settings of settingsText().
    std::string settingsHash(const CaptureSettings& capture, nlohmann::json more,
                             const Window& crop = {}) const;

    /// Sets the results common to all verbs: input, engine, device, memory, takeTimes(), and the
    /// total time up to this call.
    void finish(RunResult& result);

    /// Warns that some results lack the splats of a scene, if it has any; once per job. If the
    /// scene is read strictly, throws Error (kInput).
    void warnOfSplats(const PosedScene& posed, const std::string& what = "rays");

  private:
    const CaptureJobOptions& options_;
    Session& session_;
    Reporter& reporter_;
    Clock::time_point start_ = Clock::now();
    StageTimes times_;
    SharedScene scene_;
    std::optional<gl::Device> device_;
    GlRenderer* renderer_ = nullptr;   ///< owned by the session
    std::optional<RayEngine> engine_;  ///< kCpu or kGl; none = not chosen yet
    bool told_of_splats_ = false;
    std::unique_ptr<HitSource> rasterizer_, splat_hits_, traced_;
};

}  // namespace peeler::cmd
