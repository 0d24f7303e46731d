// SPDX-License-Identifier: Apache-2.0
// A request for a scene: which file, what of it is shown, how it looks, and when.
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

/// What of a scene file is shown.
struct SceneOptions {
    std::filesystem::path file;
    std::optional<std::string> scene;           ///< name or index; none = the file's default
    std::vector<std::string> include, exclude;  ///< globs of node names
    std::optional<Normalized> normalize;        ///< the size that it is brought to
    SceneReadOptions reading;

    bool operator==(const SceneOptions&) const = default;
};

/// Sizes that a scene can be brought to.
inline constexpr Choice<Normalized> kNormalized[] = {
    {"unit-cube", Normalized::kUnitCube, "the longest side of its bounds is 1"},
    {"unit-sphere", Normalized::kUnitSphere, "its farthest vertex is at distance 1"},
};

/// The axis that a text names, x, y or z; nothing for any other text.
std::optional<Axis> axisNamed(std::string_view text);
std::string axisName(Axis axis);

/// Returns the reading options that change pixels, for the settings' hash: an empty object if none
/// of those given does, as for a glTF.
nlohmann::json readingSettings(const SceneReadOptions& reading,
                               const std::optional<Assumed>& assumed);

/// Returns the index of the scene to show. Throws Error (kUsage), with the list, for one that is
/// not there.
int chooseScene(const Scene& scene, const SceneOptions& options);

/// For every name, whether it matches a glob: *, ? and [a-z] as in a shell.
std::vector<char> namesLike(const std::vector<std::string>& names, const std::string& glob);

/// For every node, whether it has a name that matches one of the globs or is below one that has.
/// Throws Error (kUsage) for a glob that no node matches; `option` is where it comes from.
std::vector<char> nodesMatching(const Scene& scene, const std::vector<std::string>& globs,
                                const char* option);

/// Takes away what is not to be seen: with `include` every mesh that neither is at a node of such a
/// name nor below one, with `exclude` the nodes of such names and all below them, lights included.
/// Cameras stay. Throws Error (kUsage) for a glob that no node matches.
void selectNodes(Scene& scene, const SceneOptions& options);

/// What layers hold of light that passes through glass and the like.
enum class Transmitted : std::uint8_t {
    kColor,   ///< coloured opacity, if anything tints the light
    kAlpha,   ///< one alpha
    kNothing  ///< no light passes
};

/// What makes a scene look otherwise than its file says.
struct AppearanceOptions {
    std::optional<std::string> variant;  ///< name or index
    Transmitted transmission = Transmitted::kColor;
    std::optional<std::filesystem::path> environment;  ///< a file, "studio" or "none"
    std::optional<double> environment_rotation;        ///< degrees
    /// The studio lights what has no lights of its own, unless there is an environment: for
    /// pictures for eyes.
    bool studio = false;

    bool operator==(const AppearanceOptions&) const = default;
};

/// The file that the environment is read from; none if it is built in, or there is none.
std::optional<std::filesystem::path> environmentFile(const AppearanceOptions& appearance);

/// Throws Error (kUsage) for a rotation of no environment.
void checkAppearanceOptions(const AppearanceOptions& appearance);

/// Puts the scene into the studio if `appearance` says so and nothing else lights what is shown of
/// it.
void addStudio(Scene& scene, int scene_index, const AppearanceOptions& appearance);

/// Index of the variant that was chosen; nothing if none was. Throws Error (kUsage) for an unknown
/// one, with the list.
std::optional<std::size_t> chosenVariant(const Scene& scene, const AppearanceOptions& appearance);

/// Whether opacity is to be coloured (CaptureSettings::tinted).
bool wantsTint(const AppearanceOptions& appearance, const PosedScene& posed);

/// Returns the parts of the appearance that change pixels, for the settings' hash; an empty object
/// if none was given.
nlohmann::json appearanceSettings(const AppearanceOptions& appearance, const Scene& scene);

/// When a scene is shown: at rest, at a time, at the times of frames.
struct AnimationOptions {
    std::optional<std::string> animation;    ///< name, index or "all"
    std::optional<double> time;              ///< seconds
    std::optional<std::vector<int>> frames;  ///< at least one
    std::optional<double> fps;               ///< frames a second

    /// Whether other moments than the scene at rest are asked for.
    bool moves() const { return time || frames; }
};

/// A picture of a sequence, or the only one.
struct Moment {
    int frame = 0;
    double time = 0;               ///< seconds
    double next_time = 0;          ///< of the next frame, whether it is asked for or not
    double frames_per_second = 0;  ///< 0 = it is not one of a sequence
    double motion_rate = 0;        ///< frames a second by which motion is measured
};

/// Throws Error (kUsage) for what contradicts itself whatever the scene is.
void checkAnimationOptions(const AnimationOptions& options);

/// The animations to play, indices into Scene::animations: the one that is named, or all; the first
/// if a time or frames are given; else none, and the scene is at rest. Throws Error (kUsage) with
/// the list for one that is not there.
std::vector<int> chooseAnimations(const Scene& scene, const AnimationOptions& options);

/// The moments to show, in the order asked for: frame N is at N / fps seconds.
std::vector<Moment> momentsOf(const AnimationOptions& options);

/// The name of an animation: its own, else "animation N".
std::string animationName(const Scene& scene, std::size_t animation);

/// A scene file as a run wants it. Equal requests show the same, as long as the files stay as they
/// are.
struct SceneRequest {
    SceneOptions scene;
    AppearanceOptions appearance;
    AnimationOptions animation;  ///< decides which animations play
    bool shadows = false;        ///< a scene whose lights cast none gets a warning
    /// Bytes that the reader may take; a refusal depends on it, the scene does not.
    MemoryBudget memory{};

    bool operator==(const SceneRequest& other) const {
        return scene == other.scene && appearance == other.appearance &&
               animation.animation == other.animation.animation &&
               animation.moves() == other.animation.moves() && shadows == other.shadows;
    }
};

/// Reads the scene as the request wants it: its materials of the variant, its environment by its
/// name or from the file. Throws Error (kUsage) for an unknown variant, with the list, and what
/// readSceneFile() and environmentNamed() throw.
Scene loadScene(const SceneRequest& request);

}  // namespace peeler::cmd
