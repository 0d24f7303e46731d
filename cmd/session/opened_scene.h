// SPDX-License-Identifier: Apache-2.0
// A scene read per request.
#pragma once

#include <optional>
#include <span>
#include <utility>
#include <vector>

#include "cmd/session/reporter.h"
#include "cmd/session/scene_request.h"
#include "core/scene/framing.h"
#include "core/scene/posed_scene.h"
#include "core/views/many_cameras.h"

namespace peeler::cmd {

/// A scene read once and posed at any time.
class OpenedScene {
  public:
    /// Reads the file, selects the scene, nodes and animations, and reports the readers' warnings.
    /// Throws like loadScene(), chooseScene(), selectNodes() and chooseAnimations().
    OpenedScene(const SceneRequest& request, Reporter& reporter);

    const Scene& scene() const { return scene_; }
    /// Returns the index of the shown scene.
    int index() const { return index_; }
    /// Returns the indices of the playing animations.
    const std::vector<int>& animations() const { return playing_; }
    /// Returns the transform of --normalize, if requested.
    const std::optional<Normalizing>& normalized() const { return normalized_; }
    /// Returns the values assumed for properties that the file's format does not specify.
    const std::optional<Assumed>& assumed() const { return assumed_; }

    /// Returns the scene at a time in seconds; caches the latest. This object must outlive it. Not
    /// thread-safe.
    PosedScene at(double time) const;
    /// Returns the same with some nodes placed elsewhere. Throws like placeNodes().
    PosedScene at(double time, std::span<const PlacedNode> placed) const;

    /// Returns the extent framed by a camera without a pose: over all times if the scene is
    /// animated. Not thread-safe.
    const SceneExtent& extent() const;

  private:
    Scene scene_;
    int index_ = 0;
    std::vector<int> playing_;
    std::optional<Normalizing> normalized_;
    std::optional<Assumed> assumed_;
    mutable std::optional<SceneExtent> extent_;                  ///< computed on first use
    mutable std::optional<std::pair<double, PosedScene>> last_;  ///< the latest at()
};

}  // namespace peeler::cmd
