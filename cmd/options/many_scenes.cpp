// SPDX-License-Identifier: Apache-2.0
#include "cmd/options/many_scenes.h"

#include <glob.h>

#include <algorithm>
#include <array>
#include <string_view>
#include <utility>

#include <peeler/error.h>
#include <nlohmann/json.hpp>
#include "cmd/cli/errors.h"
#include "formats/file/regular_file.h"
#include "formats/meshes/scene_reader.h"

namespace peeler::cmd {

namespace {

namespace fs = std::filesystem;

bool isGlob(const fs::path& path) {
    return path.string().find_first_of("*?[") != std::string::npos && !fileExists(path);
}

std::vector<fs::path> scenesBelow(const fs::path& folder) {
    std::vector<fs::path> scenes;
    std::error_code failure;
    for (fs::recursive_directory_iterator entry(folder, failure), end; !failure && entry != end;
         entry.increment(failure)) {
        std::error_code unknown;
        if (isSceneName(entry->path()) && entry->is_regular_file(unknown))
            scenes.push_back(entry->path());
    }
    if (failure)
        throw Error(ErrorKind::kInput, "cannot list the folder: " + failure.message(),
                    folder.string(), "check the permissions of the folders in it");
    std::ranges::sort(scenes);
    return scenes;
}

std::vector<fs::path> matches(const fs::path& pattern) {
    glob_t found{};
    glob(pattern.c_str(), 0, nullptr, &found);
    std::vector<fs::path> scenes(found.gl_pathv, found.gl_pathv + found.gl_pathc);
    globfree(&found);
    return scenes;
}

std::vector<fs::path> scenesNamed(const fs::path& name) {
    std::error_code failure;
    const bool folder = fs::is_directory(name, failure);
    if (!folder && !isGlob(name)) return {name};
    std::vector<fs::path> scenes = folder ? scenesBelow(name) : matches(name);
    if (scenes.empty())
        throw Error(ErrorKind::kInput,
                    folder ? "the folder contains no scenes" : "no file has a matching name",
                    name.string(), "give scenes whose names end in " + sceneExtensions(true));
    return scenes;
}

}  // namespace

bool isOneScene(std::span<const fs::path> names) {
    std::error_code failure;
    return names.size() == 1 && !isGlob(names.front()) && !fs::is_directory(names.front(), failure);
}

std::vector<fs::path> listScenes(std::span<const fs::path> names) {
    std::vector<fs::path> scenes;
    for (const fs::path& name : names)
        std::ranges::move(scenesNamed(name), std::back_inserter(scenes));
    return scenes;
}

fs::path namedAfter(const fs::path& scene, const fs::path& output, bool is_sample) {
    std::array<std::pair<std::string, std::string>, 2> places = {{
        {"{stem}", scene.stem().string()},
        {"{folder}", fs::absolute(scene).lexically_normal().parent_path().filename().string()},
    }};
    for (auto& [place, text] : places)
        if (is_sample)
            std::ranges::replace_if(
                text,
                [](char c) { return std::string_view(".#%@").find(c) != std::string_view::npos; },
                '_');
    std::string name = output.string();
    for (const auto& [place, text] : places) {
        for (std::size_t at = name.find(place); at != std::string::npos;
             at = name.find(place, at + text.size()))
            name.replace(at, place.size(), text);
    }
    return name;
}

void SceneOutputs::take(const fs::path& file, const fs::path& scene, const std::string& option) {
    const auto [other, is_new] = scene_of_.emplace(file, scene);
    if (is_new || other->second == scene) return;  // conflicts within a scene are found later
    refuse("the files of " + other->second.string() + " and " + scene.string() +
               " would have the same file name",
           option, "put {stem} (the scene's name) or {folder} (its folder's name) into it");
}

int makeEachScene(std::span<const fs::path> scenes, bool keep_going, Reporter& reporter,
                  Json& results, const std::function<int(std::size_t, Json&)>& make) {
    results["scenes"] = Json::array();
    int worst = 0;
    for (std::size_t i = 0; i < scenes.size(); ++i) {
        Json result;
        int code = 0;
        try {
            code = make(i, result);
        } catch (...) {
            code = reportError(reporter, currentError());
        }
        worst = std::max(worst, code);
        if (!result.is_null()) results["scenes"].push_back(result);
        if (code == 0) continue;
        results["failed"].push_back({{"input", scenes[i].string()}, {"exitCode", code}});
        if (!keep_going) break;
    }
    return worst;
}

void reportFailedScenes(const Json& results, std::size_t scenes, Reporter& reporter) {
    if (const std::size_t failed = results.value("failed", Json::array()).size(); failed > 0)
        reporter.error(groupedText(failed) + " of " + countText(scenes, "scene") + " failed");
}

}  // namespace peeler::cmd
