// SPDX-License-Identifier: Apache-2.0
// A scene file that has been read as a request wants it.
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

/// A scene file as a run shows it: read once, seen at any time.
class OpenedScene {
  public:
    /// Reads the file, chooses what is shown of it, and reports the warnings of its readers. Throws
    /// like loadScene(), chooseScene(), selectNodes() and chooseAnimations().
    OpenedScene(const SceneRequest& request, Reporter& reporter);

    const Scene& scene() const { return scene_; }
    /// Index of the scene that is shown.
    int index() const { return index_; }
    /// Indices of the animations that move it.
    const std::vector<int>& animations() const { return playing_; }
    /// What brought it to another size, if that was asked for.
    const std::optional<Normalizing>& normalized() const { return normalized_; }
    /// What the format of its file does not say, as it was understood.
    const std::optional<Assumed>& assumed() const { return assumed_; }

    /// The scene at a time, in seconds; asked again for the same time, the same. It refers to this
    /// object, which must outlive it. Not from several threads.
    PosedScene at(double time) const;
    /// The same with nodes that stand elsewhere. Throws like placeNodes().
    PosedScene at(double time, std::span<const PlacedNode> placed) const;

    /// The extent that a camera without a place of its own frames: of all times, if the scene
    /// moves. Not from several threads.
    const SceneExtent& extent() const;

  private:
    Scene scene_;
    int index_ = 0;
    std::vector<int> playing_;
    std::optional<Normalizing> normalized_;
    std::optional<Assumed> assumed_;
    mutable std::optional<SceneExtent> extent_;                  ///< once it is asked for
    mutable std::optional<std::pair<double, PosedScene>> last_;  ///< the latest of at(), and when
};

}  // namespace peeler::cmd
