// SPDX-License-Identifier: Apache-2.0
// A scene file as a command shows it: read once, seen at any time.
#pragma once

#include <optional>
#include <vector>

#include "cmd/cli/console.h"
#include "cmd/options/animation_options.h"
#include "cmd/options/camera_options.h"
#include "cmd/options/look_options.h"
#include "cmd/options/scene_options.h"
#include "core/scene/posed_scene.h"

namespace peeler::cmd {

class OpenedScene {
  public:
    /// Reads the file and warns of what it must. Throws like loadScene, chooseScene, selectNodes
    /// and chooseAnimations.
    OpenedScene(const SceneOptions& options, const LookOptions& look,
                const AnimationOptions& animation, bool shadows, Console& console);

    const Scene& scene() const { return scene_; }
    int index() const { return index_; }                             ///< of the scene shown
    const std::vector<int>& animations() const { return playing_; }  ///< that move it

    PosedScene at(double time) const;

    /// The camera's view of what at() has given. A scene that moves is framed by all its times.
    View view(const PosedScene& posed, const CameraOptions& camera) const;

  private:
    Scene scene_;
    int index_ = 0;
    std::vector<int> playing_;
    std::optional<SceneExtent> all_times_;  ///< of a scene that moves
};

}  // namespace peeler::cmd
