// SPDX-License-Identifier: Apache-2.0
// A scene that has been read for a request.
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

class OpenedScene {
  public:
    /// Reads the file, selects the scene, nodes and animations, and reports the reader's warnings.
    /// Throws like loadScene(), chooseScene(), selectNodes() and chooseAnimations().
    OpenedScene(const SceneRequest& request, Reporter& reporter);

    const Scene& scene() const { return scene_; }
    int index() const { return index_; }
    const std::vector<int>& animations() const { return playing_; }
    /// Returns the transform of --normalize, or nothing without --normalize.
    const std::optional<Normalizing>& normalized() const { return normalized_; }
    /// Returns the values that are assumed because the file's format does not specify them. Returns
    /// nothing if the format specifies all values.
    const std::optional<Assumed>& assumed() const { return assumed_; }

    /// Returns the scene at a time in seconds. Keeps the result for a later call with the same
    /// time. This object must outlive the returned scene. Not thread-safe.
    PosedScene at(double time) const;
    /// Returns the scene at a time in seconds, with some nodes moved. Throws like placeNodes().
    PosedScene at(double time, std::span<const PlacedNode> placed) const;

    /// Returns the extent that a camera without a pose frames. For an animated scene, the extent
    /// covers all times. Not thread-safe.
    const SceneExtent& extent() const;

  private:
    Scene scene_;
    int index_ = 0;
    std::vector<int> playing_;
    std::optional<Normalizing> normalized_;
    std::optional<Assumed> assumed_;
    mutable std::optional<SceneExtent> extent_;  ///< computed on first use
    /// The latest time and result of at().
    mutable std::optional<std::pair<double, PosedScene>> last_;
};

}  // namespace peeler::cmd
