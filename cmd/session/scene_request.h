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

/// The scene file, the reading options, and the part of the scene to use.
struct SceneOptions {
    std::filesystem::path file;
    std::optional<std::string> scene;           ///< name or index; none = the file's default
    std::vector<std::string> include, exclude;  ///< globs of node names
    std::optional<Normalized> normalize;
    SceneReadOptions reading;

    bool operator==(const SceneOptions&) const = default;
};

inline constexpr Choice<Normalized> kNormalized[] = {
    {"unit-cube", Normalized::kUnitCube, "scale the longest side of the bounds to 1"},
    {"unit-sphere", Normalized::kUnitSphere, "scale the farthest vertex to distance 1"},
};

/// Returns the axis called "x", "y" or "z", or nothing for any other text.
std::optional<Axis> axisNamed(std::string_view text);
std::string axisName(Axis axis);

/// Returns the reading options that change pixels, for the settings hash. Empty for glTF and for
/// default values.
nlohmann::json readingSettings(const SceneReadOptions& reading,
                               const std::optional<Assumed>& assumed);

/// Returns the index of the scene to use. Throws Error (kUsage), with the list of scenes, if the
/// requested scene does not exist.
int chooseScene(const Scene& scene, const SceneOptions& options);

/// Returns 1 for each name that matches the glob, 0 for other names. *, ? and [a-z] have the same
/// meaning as in a shell.
std::vector<char> namesLike(const std::vector<std::string>& names, const std::string& glob);

/// Returns 1 for each node if its name or an ancestor's name matches one of the globs, else 0.
/// Throws Error (kUsage) if no node matches a glob. The message names `option`.
std::vector<char> nodesMatching(const Scene& scene, const std::vector<std::string>& globs,
                                const char* option);

/// Keeps only the parts of the scene that the options select. `include` keeps the meshes of
/// matching nodes and of their descendants. `exclude` hides matching nodes and their descendants,
/// including lights. Cameras are always kept. Throws Error (kUsage) if no node matches a glob.
void selectNodes(Scene& scene, const SceneOptions& options);

/// The representation of transmissive materials in layers.
enum class Transmitted : std::uint8_t {
    kColor,   ///< coloured opacity, if any material tints the transmitted light
    kAlpha,   ///< a single alpha
    kNothing  ///< drawn as if they did not transmit light
};

/// Options that override the scene's appearance.
struct AppearanceOptions {
    std::optional<std::string> variant;  ///< name or index
    Transmitted transmission = Transmitted::kColor;
    std::optional<std::filesystem::path> environment;  ///< file name, "studio" or "none"
    std::optional<double> environment_rotation;        ///< degrees
    /// For display pictures: whether the studio lights a scene that has neither lights nor an
    /// environment.
    bool studio = false;

    bool operator==(const AppearanceOptions&) const = default;
};

/// Returns the environment's file, or nothing if the environment is built in or "none".
std::optional<std::filesystem::path> environmentFile(const AppearanceOptions& appearance);

/// Throws Error (kUsage) if a rotation is given without an environment.
void checkAppearanceOptions(const AppearanceOptions& appearance);

/// Applies --normalize to the scene with this index. Returns the transform. Throws like
/// normalizing().
Normalizing normalizeScene(Scene& scene, int scene_index, Normalized to);

/// Lights the scene with the studio if AppearanceOptions::studio is set, no environment is given,
/// and the scene with this index has surfaces but no light.
void addStudio(Scene& scene, int scene_index, const AppearanceOptions& appearance);

/// Returns the index of the requested variant, or nothing if no variant is requested. Throws Error
/// (kUsage), with the list of variants, if the variant does not exist.
std::optional<std::size_t> chosenVariant(const Scene& scene, const AppearanceOptions& appearance);

/// Whether to capture coloured opacity (CaptureSettings::tinted).
bool wantsTint(const AppearanceOptions& appearance, const PosedScene& posed);

/// Returns the appearance settings that change pixels, for the settings hash. May be empty.
nlohmann::json appearanceSettings(const AppearanceOptions& appearance, const Scene& scene);

/// The animation and its times: at rest, at one time, or at the times of frames.
struct AnimationOptions {
    std::optional<std::string> animation;    ///< name or index, or "all"
    std::optional<double> time;              ///< seconds
    std::optional<std::vector<int>> frames;  ///< numbers of the frames, at least one
    std::optional<double> fps;               ///< none = the default

    /// Whether a time or frames are given. Otherwise the scene is at rest.
    bool moves() const { return time || frames; }
};

/// The time of a frame or of a single picture.
struct Moment {
    int frame = 0;
    double time = 0;  ///< seconds
    /// Time of the next frame, in seconds, even if that frame is not requested.
    double next_time = 0;
    double frames_per_second = 0;  ///< 0 = the picture is not part of a sequence
    double motion_rate = 0;        ///< frame rate for motion vectors, frames per second
};

/// Throws Error (kUsage) if the options contradict each other. Does not need the scene.
void checkAnimationOptions(const AnimationOptions& options);

/// Returns the animations to play, as indices into Scene::animations: the requested animation, or
/// all for "all". Without a request, returns the first animation if AnimationOptions::moves(), else
/// nothing. Throws Error (kUsage), with the list of animations, if the requested animation does not
/// exist.
std::vector<int> chooseAnimations(const Scene& scene, const AnimationOptions& options);

/// Returns the times to render, in the given order. Frame N is at N / fps seconds.
std::vector<Moment> momentsOf(const AnimationOptions& options);

/// Returns an animation's name, or "animation N" if it has no name.
std::string animationName(const Scene& scene, std::size_t animation);

/// A request for a scene. Equal requests give equal scenes as long as no file changes.
struct SceneRequest {
    SceneOptions scene;
    AppearanceOptions appearance;
    AnimationOptions animation;  ///< determines which animations play
    bool shadows = false;        ///< whether to warn that no light casts shadows
    /// Memory limit for reading. Does not affect the scene.
    MemoryBudget memory{};

    bool operator==(const SceneRequest& other) const {
        return scene == other.scene && appearance == other.appearance &&
               animation.animation == other.animation.animation &&
               animation.moves() == other.animation.moves() && shadows == other.shadows;
    }
};

/// Reads the scene, applies the material variant and loads the environment. Throws Error (kUsage),
/// with the list of variants, if the variant is unknown. Throws like readSceneFile() and
/// environmentNamed().
Scene loadScene(const SceneRequest& request);

}  // namespace peeler::cmd
