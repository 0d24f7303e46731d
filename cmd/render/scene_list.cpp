// SPDX-License-Identifier: Apache-2.0
#include "cmd/render/scene_list.h"

#include <string>

#include "cmd/options/many_scenes.h"
#include "cmd/render/render_options.h"
#include "cmd/render/render_request.h"

namespace peeler::cmd {

namespace fs = std::filesystem;

bool RenderOptions::isOneScene() const {
    return cmd::isOneScene(scenes);
}

std::vector<RenderOptions> eachScene(const RenderOptions& options) {
    std::vector<RenderOptions> each;
    SceneOutputs outputs;
    for (const fs::path& scene : listScenes(options.scenes)) {
        RenderOptions& one = each.emplace_back(options);
        one.scene.file = scene;
        one.output.path = namedAfter(scene, options.output.path, options.shards != nullptr);
        outputs.take(one.output.path, scene,
                     options.shards ? "--shard-member " + options.output.path.filename().string()
                                    : "--output " + options.output.path.string());
        if (auto& manifest = one.channels.manifest) {
            manifest = namedAfter(scene, *manifest);
            outputs.take(*manifest, scene, "--manifest " + options.channels.manifest->string());
        }
        if (auto& cameras = one.views.cameras_out) {
            cameras = namedAfter(scene, *cameras);
            outputs.take(*cameras, scene, "--cameras-out " + options.views.cameras_out->string());
        }
        if (!options.isOneScene()) {  // all scenes share one report
            one.report.json = false;
            one.report.file.reset();
        }
    }
    const std::optional<Shard>& chunk = options.sequence.chunk;
    if (options.shards && chunk && !options.isOneScene()) {
        const auto [first, end] = chunk->of(each.size());
        each.erase(each.begin() + static_cast<std::ptrdiff_t>(end), each.end());
        each.erase(each.begin(), each.begin() + static_cast<std::ptrdiff_t>(first));
        for (RenderOptions& one : each)
            one.sequence.chunk.reset();
    }
    if (!each.empty()) each.front().scenes_like_this = each.size();
    return each;
}

}  // namespace peeler::cmd
