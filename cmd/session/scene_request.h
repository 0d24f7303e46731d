// SPDX-License-Identifier: Apache-2.0
// Scene requests: the file, the selection, the appearance and the time.
#pragma once

#include <cstdint>
#include <filesystem>
#include <nlohmann/json_fwd.hpp>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

#include <peeler/scene.h>
#include "cmd/session/choices.h"
#include "core/scene/posed_scene.h"
#include "core/views/many_cameras.h"
#include "formats/meshes/scene_reader.h"

namespace peeler::cmd {

/// The scene file, how to read it, and which part of it to use.
struct SceneOptions {
    std::filesystem::path file;
    std::optional<std::string> scene;           ///< name or index; none = the file's default
    std::vector<std::string> include, exclude;  ///< globs of node names
    std::optional<Normalized> normalize;        ///< none = not normalised
    SceneReadOptions reading;

    bool operator==(const SceneOptions&) const = default;
};

/// The choices of --normalize.
inline constexpr Choice<Normalized> kNormalized[] = {
    {"unit-cube", Normalized::kUnitCube, "scale the longest side of the bounds to 1"},
    {"unit-sphere", Normalized::kUnitSphere, "scale the farthest vertex to distance 1"},
};

/// Returns the axis with the name x, y or z; nothing for any other text.
std::optional<Axis> axisNamed(std::string_view text);
std::string axisName(Axis axis);

/// Returns the reading options that change pixels, for the settings hash. The object is empty if no
/// option does, as for glTF.
nlohmann::json readingSettings(const SceneReadOptions& reading,
                               const std::optional<Assumed>& assumed);

/// Returns the index of the scene to use. Throws Error (kUsage), with the list of scenes, if it
/// does not exist.
int chooseScene(const Scene& scene, const SceneOptions& options);

/// Returns, for every name, whether it matches a glob. *, ? and [a-z] mean the same as in a shell.
std::vector<char> namesLike(const std::vector<std::string>& names, const std::string& glob);

/// Returns, for every node, whether the name of the node or of an ancestor matches one of the
/// globs. Throws Error (kUsage), which names the `option` that the globs come from, if no node
/// matches a glob.
std::vector<char> nodesMatching(const Scene& scene, const std::vector<std::string>& globs,
                                const char* option);

/// Removes the parts of the scene that the options leave out. `include` keeps only the meshes at
/// matching nodes and below them. `exclude` removes matching nodes and everything below them,
/// including lights. Cameras are never removed. Throws Error (kUsage) if no node matches a glob.
void selectNodes(Scene& scene, const SceneOptions& options);

/// The representation of transmissive materials in layers.
enum class Transmitted : std::uint8_t {
    kColor,   ///< coloured opacity, if any material tints the transmitted light
    kAlpha,   ///< a single alpha
    kNothing  ///< as if they did not transmit light
};

/// Options that override the scene's appearance.
struct AppearanceOptions {
    std::optional<std::string> variant;  ///< name or index
    Transmitted transmission = Transmitted::kColor;
    std::optional<std::filesystem::path> environment;  ///< a file's name, "studio" or "none"
    std::optional<double> environment_rotation;        ///< degrees
    /// For display pictures: whether to light the scene with the studio if it has neither lights
    /// nor an environment.
    bool studio = false;

    bool operator==(const AppearanceOptions&) const = default;
};

/// Returns the environment's file, or nothing for a built-in environment or no environment.
std::optional<std::filesystem::path> environmentFile(const AppearanceOptions& appearance);

/// Throws Error (kUsage) if a rotation is given without an environment.
void checkAppearanceOptions(const AppearanceOptions& appearance);

/// Lights the scene with the studio if `appearance` asks for it and the scene with this index has
/// no light.
void addStudio(Scene& scene, int scene_index, const AppearanceOptions& appearance);

/// Returns the index of the chosen variant, if any. Throws Error (kUsage), with the list of
/// variants, if it does not exist.
std::optional<std::size_t> chosenVariant(const Scene& scene, const AppearanceOptions& appearance);

/// Whether to capture coloured opacity (CaptureSettings::tinted).
bool wantsTint(const AppearanceOptions& appearance, const PosedScene& posed);

/// Returns the options that change pixels, for the settings hash. The object is empty if no option
/// is given.
nlohmann::json appearanceSettings(const AppearanceOptions& appearance, const Scene& scene);

/// The animation and the time: at rest, at one time, or at the times of frames.
struct AnimationOptions {
    std::optional<std::string> animation;    ///< name, index or "all"
    std::optional<double> time;              ///< seconds
    std::optional<std::vector<int>> frames;  ///< at least one
    std::optional<double> fps;               ///< frames per second; none = the default

    /// Whether a time or frames are given, so that the scene is not at rest.
    bool moves() const { return time || frames; }
};

/// The time of a frame or of a single picture.
struct Moment {
    int frame = 0;
    double time = 0;  ///< seconds
    /// The time of the following frame in seconds, whether or not it is requested.
    double next_time = 0;
    double frames_per_second = 0;  ///< 0 = not a sequence
    double motion_rate = 0;        ///< frames per second that motion vectors refer to
};

/// Throws Error (kUsage) if the options contradict each other, regardless of the scene.
void checkAnimationOptions(const AnimationOptions& options);

/// Returns the animations to play, as indices into Scene::animations. These are the requested one,
/// or all; without a request, the first if a time or frames are given; else none, and the scene is
/// at rest. Throws Error (kUsage), with the list of animations, if the requested one does not
/// exist.
std::vector<int> chooseAnimations(const Scene& scene, const AnimationOptions& options);

/// Returns the moments to render, in the given order. Frame N is at N / fps seconds.
std::vector<Moment> momentsOf(const AnimationOptions& options);

/// Returns the name of an animation, or if it has none "animation N".
std::string animationName(const Scene& scene, std::size_t animation);

/// A request for a scene. Equal requests result in equal scenes as long as the files do not change.
struct SceneRequest {
    SceneOptions scene;
    AppearanceOptions appearance;
    AnimationOptions animation;  ///< determines which animations play
    bool shadows = false;        ///< whether to warn if no light of the scene casts shadows
    /// The memory limit for reading. It may cause an error but does not change the scene.
    MemoryBudget memory{};

    bool operator==(const SceneRequest& other) const {
        return scene == other.scene && appearance == other.appearance &&
               animation.animation == other.animation.animation &&
               animation.moves() == other.animation.moves() && shadows == other.shadows;
    }
};

/// Reads the scene, applies the material variant and loads the environment. Throws Error (kUsage),
/// with the list of variants, if the variant is unknown, and like readSceneFile() and
/// environmentNamed().
Scene loadScene(const SceneRequest& request);

}  // namespace peeler::cmd
