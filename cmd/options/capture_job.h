// SPDX-License-Identifier: Apache-2.0
// What verbs that capture a scene have in common: the scene they open, the device they choose, the
// time they take, and what they report of it.
#pragma once

#include <chrono>
#include <filesystem>
#include <memory>
#include <nlohmann/json.hpp>
#include <optional>
#include <string>
#include <vector>

#include "cmd/cli/console.h"
#include "cmd/cli/report.h"
#include "cmd/options/camera_options.h"
#include "cmd/options/capture_options.h"
#include "cmd/options/scene_options.h"
#include "core/capture/renderer.h"
#include "core/scene/posed_scene.h"

namespace peeler::cmd {

/// What every one of them is asked for.
struct CaptureJobOptions {
    SceneOptions scene;
    AnimationOptions animation;
    AppearanceOptions appearance;
    CaptureSettings capture;  ///< as declared
    gl::ContextRequest device;
    int threads = 0;
    ReportOptions report;
};

/// Declares SCENE, an argument.
void addSceneArgument(VerbOptions& verb, CaptureJobOptions& options);
/// Declares addSceneOptions() and addTimeOptions().
void addShownOptions(VerbOptions& verb, CaptureJobOptions& options);
/// Declares addMachineOptions() and addReportOptions(); `memory` says how a verb keeps to --memory.
void addRunOptions(VerbOptions& verb, CaptureJobOptions& options,
                   const std::string& memory = "the picture is rendered in bands that fit");

/// What is shown of the scene's file.
struct ShownScene {
    int scene = 0;                  ///< index
    std::vector<int> animations{};  ///< indices
    std::vector<std::string> include{}, exclude{};
    double frames_per_second = 0;  ///< that motion is measured by; 0 = it is not
    /// The pixels that a share of them is taken of, for --occlusion-ratio: tiles keep other layers
    /// than the whole.
    Window crop{};
};

/// Everything that was asked for and changes pixels (peeler:settingsHash), as 16 hexadecimal
/// digits. Two renders of the same scene file with the same hash, time and camera
/// (peeler:cameraJson) have the same layers. What the header says in full is left out, so that the
/// tiles of a picture and the frames of a sequence share a hash: camera, size, crop and time; and
/// so is what changes nothing: threads, memory, backend, and which of the exact methods it is.
/// `more`: an object of what else there is, such as appearanceSettings().
std::string settingsHash(const ShownScene& shown, const CaptureSettings& capture,
                         const nlohmann::json& more = nlohmann::json::object());

/// A scene file as a command shows it: read once, seen at any time.
class OpenedScene {
  public:
    /// Reads the file and warns of what it must. Throws like loadScene, chooseScene, selectNodes
    /// and chooseAnimations.
    OpenedScene(const CaptureJobOptions& options, Console& console);

    const Scene& scene() const { return scene_; }
    int index() const { return index_; }                             ///< of the scene shown
    const std::vector<int>& animations() const { return playing_; }  ///< that move it

    PosedScene at(double time) const;

    /// The camera's view of what at() has given. A scene that moves is framed by all its times.
    View view(const PosedScene& posed, const CameraOptions& camera) const;

  private:
    Scene scene_;
    int index_ = 0;
    std::vector<int> playing_;
    std::optional<SceneExtent> all_times_;  ///< of a scene that moves
};

/// One run over one scene, from options to a result, stage after stage: checkOptions(),
/// openScene(), checkOutputs(), openRenderer(), finish().
class CaptureJob {
  public:
    using Clock = std::chrono::steady_clock;

    /// The run begins; from here on the console is as quiet as it was asked to be. Options and
    /// console must outlive the job.
    CaptureJob(const CaptureJobOptions& options, Console& console);

    /// Throws Error (kUsage) for what contradicts itself whatever the scene is; sets the threads.
    void checkOptions() const;

    /// Reads the scene, as OpenedScene does. It lives as long as the job.
    const OpenedScene& openScene();
    /// Throws like checkSceneFiles() if `outputs`, or the report, would replace a file of the
    /// scene.
    void checkOutputs(std::vector<std::filesystem::path> outputs) const;
    /// The scene at the time that was asked for.
    PosedScene pose();

    /// Opens a context as openContext() does, and uploads the scene. A Renderer that is there has
    /// to be closed before.
    Renderer& openRenderer(const PosedScene& posed);
    void closeRenderer();
    /// Null if none is open: its context may be there nevertheless, if the scene had no room in it.
    Renderer* renderer() { return renderer_ ? &*renderer_ : nullptr; }
    bool hasContext() const { return context_ != nullptr; }
    const gl::Device& device() const { return *device_; }  ///< of the Renderer opened last

    Clock::time_point start() const { return start_; }
    /// What stages have taken: a verb adds its own.
    StageTimes& times() { return times_; }
    /// Those and the Renderer's, since the last call.
    StageTimes takeTimes();

    /// settingsHash() of the opened scene and how it looks. `crop` and `frames_per_second`: as in
    /// ShownScene.
    std::string settingsHash(const CaptureSettings& capture, nlohmann::json more,
                             const Window& crop = {}, double frames_per_second = 0) const;

    /// Fills in what every verb reports alike: the input, the device if there was one, the memory,
    /// and takeTimes() with the run's total, which ends here.
    void finish(RunResult& result);

  private:
    const CaptureJobOptions& options_;
    Console& console_;
    Clock::time_point start_ = Clock::now();
    StageTimes times_;
    std::optional<OpenedScene> scene_;
    std::optional<gl::Device> device_;
    std::unique_ptr<gl::Context> context_;  // before what lives in it
    std::optional<Renderer> renderer_;
};

}  // namespace peeler::cmd
