// SPDX-License-Identifier: Apache-2.0
#include "cmd/session/opened_scene.h"

namespace peeler::cmd {

OpenedScene::OpenedScene(const SceneRequest& request, Reporter& reporter)
    : scene_(loadScene(request)), assumed_(assumedOf(request.scene.file, request.scene.reading)) {
    for (const Text& warning : scene_.warnings)
        reporter.warning(warning);
    index_ = chooseScene(scene_, request.scene);
    selectNodes(scene_, request.scene);
    addStudio(scene_, index_, request.appearance);
    if (request.scene.normalize)
        normalized_ = normalizeScene(scene_, index_, *request.scene.normalize);
    playing_ = chooseAnimations(scene_, request.animation);
}

PosedScene OpenedScene::at(double time) const {
    const double moment = playing_.empty() ? 0 : time;
    if (!last_ || last_->first != moment)
        last_.emplace(moment, PosedScene(scene_, index_, poseAt(scene_, playing_, moment)));
    return last_->second;
}

PosedScene OpenedScene::at(double time, std::span<const PlacedNode> placed) const {
    if (placed.empty()) return at(time);
    Pose pose = poseAt(scene_, playing_, time);
    placeNodes(scene_, index_, placed, pose);
    return {scene_, index_, pose};
}

const SceneExtent& OpenedScene::extent() const {
    if (!extent_ && playing_.empty()) extent_.emplace(at(0));
    if (!extent_) extent_.emplace(scene_, index_, playing_);
    return *extent_;
}

}  // namespace peeler::cmd
