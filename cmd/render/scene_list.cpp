// SPDX-License-Identifier: Apache-2.0
#include "cmd/render/scene_list.h"

#include <glob.h>

#include <algorithm>
#include <array>
#include <map>
#include <string>
#include <string_view>
#include <utility>

#include <peeler/error.h>
#include "cmd/cli/errors.h"
#include "cmd/render/render_options.h"
#include "cmd/render/render_request.h"
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

/// Returns an output's name with {stem} and {folder} replaced. In a sample's name, underscores
/// replace characters that would end the key or look like a number pattern.
fs::path named(const fs::path& output, const fs::path& scene, bool is_sample = false) {
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

}  // namespace

bool RenderOptions::isOneScene() const {
    std::error_code failure;
    return scenes.size() == 1 && !isGlob(scenes.front()) &&
           !fs::is_directory(scenes.front(), failure);
}

std::vector<RenderOptions> eachScene(const RenderOptions& options) {
    std::vector<RenderOptions> each;
    std::map<fs::path, fs::path> scene_of;  // the scene of each output
    const auto take = [&](const fs::path& file, const fs::path& scene, const std::string& option) {
        const auto [other, is_new] = scene_of.emplace(file, scene);
        // A later check finds conflicts within a scene.
        if (is_new || other->second == scene) return;
        refuse("the files of " + other->second.string() + " and " + scene.string() +
                   " would have the same file name",
               option, "put {stem} (the scene's name) or {folder} (its folder's name) into it");
    };
    for (const fs::path& name : options.scenes) {
        for (const fs::path& scene : scenesNamed(name)) {
            RenderOptions& one = each.emplace_back(options);
            one.scene.file = scene;
            one.output.path = named(options.output.path, scene, options.shards != nullptr);
            take(one.output.path, scene,
                 options.shards ? "--shard-member " + options.output.path.filename().string()
                                : "--output " + options.output.path.string());
            if (auto& manifest = one.channels.manifest) {
                manifest = named(*manifest, scene);
                take(*manifest, scene, "--manifest " + options.channels.manifest->string());
            }
            if (auto& cameras = one.views.cameras_out) {
                cameras = named(*cameras, scene);
                take(*cameras, scene, "--cameras-out " + options.views.cameras_out->string());
            }
            if (!options.isOneScene()) {  // all scenes share one report
                one.report.json = false;
                one.report.file.reset();
            }
        }
    }
    const std::optional<Shard>& chunk = options.sequence.chunk;
    if (!options.shards || !chunk || options.isOneScene()) return each;
    const auto [first, end] = chunk->of(each.size());
    each.erase(each.begin() + static_cast<std::ptrdiff_t>(end), each.end());
    each.erase(each.begin(), each.begin() + static_cast<std::ptrdiff_t>(first));
    for (RenderOptions& one : each)
        one.sequence.chunk.reset();
    return each;
}

}  // namespace peeler::cmd
