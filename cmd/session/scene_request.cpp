// SPDX-License-Identifier: Apache-2.0
#include "cmd/session/scene_request.h"

#include <fnmatch.h>

#include <algorithm>
#include <cmath>
#include <nlohmann/json.hpp>
#include <numbers>
#include <numeric>

#include <peeler/error.h>
#include "formats/file/content_hash.h"
#include "formats/image/environment_file.h"

namespace peeler::cmd {

namespace {

constexpr std::string_view kAxes = "xyz";

/// Returns 1 for each node whose own name matches one of the globs, 0 for other nodes. Throws like
/// nodesMatching().
std::vector<char> matching(const Scene& scene, const std::vector<std::string>& globs,
                           const char* option) {
    std::vector<char> result(scene.nodes.size(), 0);
    std::vector<std::string> names;
    for (std::size_t i = 0; i < result.size(); ++i)
        names.push_back(nodeName(scene, i));
    for (const std::string& glob : globs) {
        const std::vector<char> found = namesLike(names, glob);
        for (std::size_t i = 0; i < result.size(); ++i)
            result[i] |= found[i];
        if (std::ranges::find(found, 1) != found.end()) continue;
        throw Error(
            ErrorKind::kUsage, "no node has a matching name", std::string(option) + ' ' + glob,
            choiceHint(glob, "nodes", std::vector<std::string_view>(names.begin(), names.end())));
    }
    return result;
}

/// Also marks the descendants of marked nodes.
void spread(const Scene& scene, std::vector<char>& marked) {
    std::vector<int> open;
    for (std::size_t i = 0; i < marked.size(); ++i)
        if (marked[i]) open.push_back(static_cast<int>(i));
    while (!open.empty()) {
        const Node& node = scene.nodes[static_cast<std::size_t>(open.back())];
        open.pop_back();
        for (const int child : node.children) {
            char& mark = marked[static_cast<std::size_t>(child)];
            if (!mark) open.push_back(child);
            mark = 1;
        }
    }
}

std::size_t variantNamed(const Scene& scene, const std::string& text) {
    std::vector<std::vector<std::string>> names;
    for (const std::string& name : scene.variants)
        names.push_back({name});
    if (const auto found = findNameOrIndex(text, names)) return *found;
    std::string hint =
        choiceHint(text, "variants",
                   std::vector<std::string_view>(scene.variants.begin(), scene.variants.end()));
    if (!names.empty()) hint += "; or give an index from 0 to " + std::to_string(names.size() - 1);
    throw Error(ErrorKind::kUsage, "unknown variant", "--variant " + text, hint);
}

constexpr const char* kNoEnvironment = "none";

bool hasEnvironment(const AppearanceOptions& appearance) {
    return appearance.environment && appearance.environment != kNoEnvironment;
}

/// Returns the environment's rotation in degrees without full turns.
double turn(const AppearanceOptions& appearance) {
    return std::remainder(appearance.environment_rotation.value_or(0), 360.0);
}

constexpr double kDefaultFps = 24;

}  // namespace

std::optional<Axis> axisNamed(std::string_view text) {
    const std::size_t axis = text.size() == 1 ? kAxes.find(text) : std::string_view::npos;
    if (axis == std::string_view::npos) return {};
    return static_cast<Axis>(axis);
}

std::string axisName(Axis axis) {
    return std::string(1, kAxes[static_cast<std::size_t>(axis)]);
}

nlohmann::json readingSettings(const SceneReadOptions& reading,
                               const std::optional<Assumed>& assumed) {
    nlohmann::json settings = nlohmann::json::object();
    if (!assumed) return settings;
    if (assumed->up != Axis::kY) settings["up"] = axisName(assumed->up);
    if (assumed->metres_per_unit != 1) settings["metresPerUnit"] = assumed->metres_per_unit;
    if (reading.smooth_normals) settings["smoothNormals"] = *reading.smooth_normals;
    return settings;
}

int chooseScene(const Scene& scene, const SceneOptions& options) {
    if (!options.scene) return scene.default_scene;
    std::vector<std::vector<std::string>> names;
    for (std::size_t i = 0; i < scene.scenes.size(); ++i) {
        const std::string& name = scene.scenes[i].name;
        names.push_back({name.empty() ? "scene " + std::to_string(i) : name});
    }
    return static_cast<int>(chooseFrom("scene", "--scene", *options.scene, names));
}

std::vector<char> namesLike(const std::vector<std::string>& names, const std::string& glob) {
    std::vector<char> like(names.size(), 0);
    for (std::size_t i = 0; i < names.size(); ++i)
        like[i] = fnmatch(glob.c_str(), names[i].c_str(), 0) == 0 ? 1 : 0;
    return like;
}

std::vector<char> nodesMatching(const Scene& scene, const std::vector<std::string>& globs,
                                const char* option) {
    std::vector<char> marked = matching(scene, globs, option);
    spread(scene, marked);
    return marked;
}

void selectNodes(Scene& scene, const SceneOptions& options) {
    if (!options.include.empty()) {
        const std::vector<char> included = nodesMatching(scene, options.include, "--include");
        for (std::size_t i = 0; i < included.size(); ++i)
            if (!included[i]) scene.nodes[i].mesh = scene.nodes[i].skin = -1;
    }
    const std::vector<char> excluded = matching(scene, options.exclude, "--exclude");
    for (std::size_t i = 0; i < excluded.size(); ++i)
        if (excluded[i]) scene.nodes[i].visible = false;
}

std::optional<std::size_t> chosenVariant(const Scene& scene, const AppearanceOptions& appearance) {
    if (!appearance.variant) return {};
    return variantNamed(scene, *appearance.variant);
}

std::optional<std::filesystem::path> environmentFile(const AppearanceOptions& appearance) {
    if (appearance.environment == kStudioName || !hasEnvironment(appearance)) return {};
    return appearance.environment;
}

void checkAppearanceOptions(const AppearanceOptions& appearance) {
    if (appearance.environment_rotation && !hasEnvironment(appearance))
        throw Error(ErrorKind::kUsage, "there is no environment to rotate",
                    "--environment-rotation", "add --environment FILE");
}

Scene loadScene(const SceneRequest& request) {
    const AppearanceOptions& appearance = request.appearance;
    SceneReadOptions reading = request.scene.reading;
    reading.memory = request.memory;
    reading.transmission = appearance.transmission != Transmitted::kNothing;
    Scene scene = readSceneFile(request.scene.file, reading);
    if (const auto variant = chosenVariant(scene, appearance)) chooseVariant(scene, *variant);
    if (!hasEnvironment(appearance)) return scene;
    ReadWarnings warnings(reading.strict, appearance.environment->string());
    scene.environment = environmentNamed(appearance.environment->string(), warnings);
    for (Text& sentence : warnings.take())
        scene.warnings.push_back(std::move(sentence));
    scene.environment->rotation = turn(appearance) * std::numbers::pi / 180;
    if (request.shadows && scene.lights.empty()) {
        const std::string why = "the environment is the only light, and it casts no shadows";
        if (reading.strict)
            throw Error(ErrorKind::kUsage, why, "--shadows", "leave it out, or leave --strict out");
        scene.warnings.push_back("T" + why.substr(1) + ".");
    }
    return scene;
}

bool wantsTint(const AppearanceOptions& appearance, const PosedScene& posed) {
    return appearance.transmission == Transmitted::kColor && posed.hasTintedGlass();
}

Normalizing normalizeScene(Scene& scene, int scene_index, Normalized to) {
    const Normalizing by = normalizing(PosedScene(scene, scene_index), to);
    scene.scenes[static_cast<std::size_t>(scene_index)].to_world = by.matrix();
    return by;
}

void addStudio(Scene& scene, int scene_index, const AppearanceOptions& appearance) {
    if (!appearance.studio || appearance.environment) return;
    const PosedScene posed(scene, scene_index);
    if (!posed.lights().empty() || posed.drawList().draws().empty())
        return;  // splats take no light
    scene.environment = namedStudio();
}

nlohmann::json appearanceSettings(const AppearanceOptions& appearance, const Scene& scene) {
    nlohmann::json settings = nlohmann::json::object();
    if (const auto variant = chosenVariant(scene, appearance)) settings["variant"] = *variant;
    if (appearance.transmission == Transmitted::kNothing) settings["transmission"] = "opaque";
    if (!scene.environment) return settings;
    settings["environment"] = hexText(scene.environment->content_hash);
    settings["environmentRotation"] = turn(appearance);
    return settings;
}

void checkAnimationOptions(const AnimationOptions& options) {
    if (options.time && options.frames) {
        throw Error(ErrorKind::kUsage, "every frame already has its own time", "--time, --frames",
                    "leave one of them out");
    }
    if (options.fps && !options.frames && !options.time) {
        throw Error(ErrorKind::kUsage, "a frame rate needs frames", "--fps",
                    "add --frames, or --time for motion to the next frame");
    }
}

std::string animationName(const Scene& scene, std::size_t animation) {
    const std::string& name = scene.animations[animation].name;
    return name.empty() ? "animation " + std::to_string(animation) : name;
}

std::vector<int> chooseAnimations(const Scene& scene, const AnimationOptions& options) {
    std::vector<std::vector<std::string>> names;
    for (std::size_t i = 0; i < scene.animations.size(); ++i)
        names.push_back({animationName(scene, i)});
    if (!options.animation) {
        const bool moves = options.moves() && !names.empty();
        return moves ? std::vector<int>{0} : std::vector<int>{};
    }
    if (*options.animation == "all" && !names.empty() && !findNameOrIndex("all", names)) {
        std::vector<int> all(names.size());
        std::iota(all.begin(), all.end(), 0);
        return all;
    }
    return {static_cast<int>(chooseFrom("animation", "--animation", *options.animation, names))};
}

std::vector<Moment> momentsOf(const AnimationOptions& options) {
    const double fps = options.fps.value_or(kDefaultFps);
    if (!options.frames) {
        const double time = options.time.value_or(0);
        return {{0, time, time + 1 / fps, 0, fps}};
    }
    std::vector<Moment> moments;
    for (const int frame : *options.frames)
        moments.push_back({frame, frame / fps, (frame + 1.0) / fps, fps, fps});
    return moments;
}

}  // namespace peeler::cmd
