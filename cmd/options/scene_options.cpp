// SPDX-License-Identifier: Apache-2.0
#include "cmd/options/scene_options.h"

#include <fnmatch.h>

#include <algorithm>
#include <nlohmann/json.hpp>

#include "cmd/cli/arguments.h"
#include "cmd/cli/choices.h"
#include "cmd/cli/parse.h"
#include "core/base/error.h"

namespace peeler::cmd {

namespace {

constexpr std::string_view kAxes = "xyz";

/// Marks the nodes whose names match one of the globs. Throws like nodesMatching().
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
            ErrorKind::kUsage, "no node has a name like this", std::string(option) + ' ' + glob,
            choiceHint(glob, "nodes", std::vector<std::string_view>(names.begin(), names.end())));
    }
    return result;
}

/// Marks what is below marked nodes, too.
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

}  // namespace

void addSceneOptions(VerbOptions& verb, SceneOptions& options) {
    constexpr const char* kGroup = "Scene";
    addValue(
        verb, "--scene", "NAME|INDEX", options.scene, [](const std::string& text) { return text; },
        "which of the file's scenes (default: its own choice)")
        .group(kGroup);
    verb.addRepeated(
            "--include", "GLOB", [&](const std::string& text) { options.include.push_back(text); },
            "show only the meshes of nodes with such a name, and of those below them; *, ? and "
            "[a-z] as in a shell; may be repeated")
        .group(kGroup);
    verb.addRepeated(
            "--exclude", "GLOB", [&](const std::string& text) { options.exclude.push_back(text); },
            "leave out nodes with such a name and all below them, lights included; may be repeated")
        .group(kGroup);
    addSandboxOption(verb, options.reading.allow_outside);
    addStrictOption(verb, options.reading.strict);
    verb.addRepeated(
            "--ignore-extension", "NAME",
            [&](const std::string& text) { options.reading.ignored_extensions.push_back(text); },
            "go on without a glTF extension that the file requires and peeler lacks; textures "
            "that only it has an image for are left out; may be repeated")
        .group(kGroup);
    addValue(
        verb, "--smooth-normals", "DEGREES", options.reading.smooth_normals,
        [](const std::string& text) { return parseNumber(text); },
        "of a PLY, STL or OBJ without normals: surfaces are smooth across edges that turn by so "
        "much at most, 0 to 180 (default: every triangle is flat)")
        .group(kGroup);
    if (!verb.knows("--unit")) addUnitOption(verb, options.reading);
}

void addUnitOption(VerbOptions& verb, SceneReadOptions& reading) {
    addValue(
        verb, "--unit", "NAME", reading.metres_per_unit,
        [](const std::string& text) { return choose<double>("unit", kLengthUnits, text); },
        "what a unit of a PLY, STL or OBJ is; the scene has metres then (default: numbers stay as "
        "they are):")
        .oneOf(describeChoices(kLengthUnits))
        .group("Scene");
}

std::optional<Axis> axisNamed(std::string_view text) {
    const std::size_t axis = text.size() == 1 ? kAxes.find(text) : std::string_view::npos;
    if (axis == std::string_view::npos) return {};
    return static_cast<Axis>(axis);
}

std::string axisName(Axis axis) {
    return std::string(1, kAxes[static_cast<std::size_t>(axis)]);
}

void addUpOption(VerbOptions& verb, SceneReadOptions& reading) {
    verb.addText(
            "--up", "x|y|z",
            [&](const std::string& text) {
                reading.up = axisNamed(text);
                if (!reading.up) throw Error(ErrorKind::kUsage, "expected an axis: x, y or z");
            },
            kUpHelp)
        .group("Scene");
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

void addSandboxOption(VerbOptions& verb, bool& allow_outside) {
    verb.addFlag("--allow-outside", allow_outside,
                 "read the buffers and images of the scene wherever it says: without this, nothing "
                 "outside its folder (absolute paths, \"..\", symbolic links)")
        .group("Scene");
}

void addStrictOption(VerbOptions& verb, bool& strict) {
    verb.addFlag("--strict", strict,
                 "a warning about what an input says and is not shown is an error (exit code 3); "
                 "nothing is written then")
        .group("Messages");
}

void addNormalizeOption(VerbOptions& verb, SceneOptions& options) {
    addValue(
        verb, "--normalize", "NAME", options.normalize,
        [](const std::string& text) {
            return choose<Normalized>("size of a scene", kNormalized, text);
        },
        "move the middle of what is shown, as it is at rest, to the origin, and scale it alike in "
        "all directions:")
        .oneOf(describeChoices(kNormalized))
        .group("Scene");
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

}  // namespace peeler::cmd
