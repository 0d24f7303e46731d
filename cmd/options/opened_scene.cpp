// SPDX-License-Identifier: Apache-2.0
#include "cmd/options/opened_scene.h"

namespace peeler::cmd {

OpenedScene::OpenedScene(const SceneOptions& options, const LookOptions& look,
                         const AnimationOptions& animation, bool shadows, Console& console)
    : scene_(loadScene(options.file, options.gltf, look, shadows)) {
    for (const std::string& warning : scene_.warnings)
        console.warning(warning);
    index_ = chooseScene(scene_, options);
    selectNodes(scene_, options);
    playing_ = chooseAnimations(scene_, animation);
    if ((animation.frames || animation.time) && playing_.empty())
        console.warning("The scene has no animation; it is the same at all times.");
    if (!playing_.empty()) all_times_.emplace(scene_, index_, playing_);
}

PosedScene OpenedScene::at(double time) const {
    if (playing_.empty()) return {scene_, index_};
    return {scene_, index_, poseAt(scene_, playing_, time)};
}

View OpenedScene::view(const PosedScene& posed, const CameraOptions& camera) const {
    return makeView(posed, all_times_ ? *all_times_ : SceneExtent(posed), camera);
}

}  // namespace peeler::cmd
