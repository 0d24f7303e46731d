// SPDX-License-Identifier: Apache-2.0
// Scene requests: file, selection, appearance and time.
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

/// The selection from a scene file.
struct SceneOptions {
    std::filesystem::path file;
    std::optional<std::string> scene;           ///< name or index; none = the file's default
    std::vector<std::string> include, exclude;  ///< globs of node names
    std::optional<Normalized> normalize;        ///< target size
    SceneReadOptions reading;

    bool operator==(const SceneOptions&) const = default;
};

/// The choices of --normalize.
inline constexpr Choice<Normalized> kNormalized[] = {
    {"unit-cube", Normalized::kUnitCube, "scale the longest side of the bounds to 1"},
    {"unit-sphere", Normalized::kUnitSphere, "scale the farthest vertex to distance 1"},
};

/// Returns the axis named x, y or z; nothing for any other text.
std::optional<Axis> axisNamed(std::string_view text);
std::string axisName(Axis axis);

/// Returns the reading options that change pixels, for the settings' hash: an empty object if none
/// does, as for a glTF.
nlohmann::json readingSettings(const SceneReadOptions& reading,
                               const std::optional<Assumed>& assumed);

/// Returns the index of the scene to show. Throws Error (kUsage), with the list, if it does not
/// exist.
int chooseScene(const Scene& scene, const SceneOptions& options);

/// Returns for every name whether it matches a glob: *, ? and [a-z] as in a shell.
std::vector<char> namesLike(const std::vector<std::string>& names, const std::string& glob);

/// Returns for every node whether its name, or an ancestor's, matches one of the globs. Throws
/// Error (kUsage) if no node matches a glob; `option` is the option it came from.
std::vector<char> nodesMatching(const Scene& scene, const std::vector<std::string>& globs,
                                const char* option);

/// Removes hidden parts of the scene. `include` keeps only meshes at matching nodes or below them.
/// `exclude` removes matching nodes and everything below them, including lights. Cameras stay.
/// Throws Error (kUsage) if no node matches a glob.
void selectNodes(Scene& scene, const SceneOptions& options);

/// The opacity of transmissive materials in layers.
enum class Transmitted : std::uint8_t {
    kColor,   ///< coloured opacity, if any material tints light
    kAlpha,   ///< one alpha
    kNothing  ///< no transmission
};

/// Options that override the scene's appearance.
struct AppearanceOptions {
    std::optional<std::string> variant;  ///< name or index
    Transmitted transmission = Transmitted::kColor;
    std::optional<std::filesystem::path> environment;  ///< a file, "studio" or "none"
    std::optional<double> environment_rotation;        ///< degrees
    /// For display pictures: lights the scene with the studio if it has neither lights nor an
    /// environment.
    bool studio = false;

    bool operator==(const AppearanceOptions&) const = default;
};

/// Returns the environment's file; nothing if it is built in or absent.
std::optional<std::filesystem::path> environmentFile(const AppearanceOptions& appearance);

/// Throws Error (kUsage) if a rotation is given without an environment.
void checkAppearanceOptions(const AppearanceOptions& appearance);

/// Lights the scene with the studio if `appearance` asks for it and the shown scene has no light.
void addStudio(Scene& scene, int scene_index, const AppearanceOptions& appearance);

/// Returns the index of the chosen variant, if any. Throws Error (kUsage), with the list, if it is
/// unknown.
std::optional<std::size_t> chosenVariant(const Scene& scene, const AppearanceOptions& appearance);

/// Whether to capture coloured opacity (CaptureSettings::tinted).
bool wantsTint(const AppearanceOptions& appearance, const PosedScene& posed);

/// Returns the parts of the appearance that change pixels, for the settings' hash; an empty object
/// if none was given.
nlohmann::json appearanceSettings(const AppearanceOptions& appearance, const Scene& scene);

/// The time of a scene: at rest, at a time, or at the times of frames.
struct AnimationOptions {
    std::optional<std::string> animation;    ///< name, index or "all"
    std::optional<double> time;              ///< seconds
    std::optional<std::vector<int>> frames;  ///< at least one
    std::optional<double> fps;               ///< frames per second

    /// Whether a time or frames are given.
    bool moves() const { return time || frames; }
};

/// A moment of a sequence, or the only one.
struct Moment {
    int frame = 0;
    double time = 0;               ///< seconds
    double next_time = 0;          ///< of the next frame, requested or not
    double frames_per_second = 0;  ///< 0 = not a sequence
    double motion_rate = 0;        ///< frames per second, for motion vectors
};

/// Throws Error (kUsage) if the options contradict each other, regardless of the scene.
void checkAnimationOptions(const AnimationOptions& options);

/// Returns the animations to play, indices into Scene::animations: the named one, or all; the first
/// if a time or frames are given; else none, and the scene is at rest. Throws Error (kUsage), with
/// the list, if the named one does not exist.
std::vector<int> chooseAnimations(const Scene& scene, const AnimationOptions& options);

/// Returns the moments to show, in the given order: frame N is at N / fps seconds.
std::vector<Moment> momentsOf(const AnimationOptions& options);

/// Returns the name of an animation, else "animation N".
std::string animationName(const Scene& scene, std::size_t animation);

/// A request for a scene. Equal requests give equal scenes as long as the files are unchanged.
struct SceneRequest {
    SceneOptions scene;
    AppearanceOptions appearance;
    AnimationOptions animation;  ///< decides which animations play
    bool shadows = false;        ///< warns if no light of the scene casts shadows
    /// Memory limit of the reader. It can cause an error but does not change the scene.
    MemoryBudget memory{};

    bool operator==(const SceneRequest& other) const {
        return scene == other.scene && appearance == other.appearance &&
               animation.animation == other.animation.animation &&
               animation.moves() == other.animation.moves() && shadows == other.shadows;
    }
};

/// Reads the scene, applies the material variant, and loads the environment. Throws Error (kUsage),
/// with the list, if the variant is unknown, and like readSceneFile() and environmentNamed().
Scene loadScene(const SceneRequest& request);

}  // namespace peeler::cmd
