// SPDX-License-Identifier: Apache-2.0
// Which camera and which picture are asked for, and the View that follows.
#pragma once

#include <glm/glm.hpp>
#include <optional>
#include <string>
#include <vector>

#include <peeler/camera_choice.h>
#include <peeler/view.h>
#include "cmd/cli/parse.h"
#include "core/scene/framing.h"
#include "core/scene/posed_scene.h"
#include "formats/meshes/scene_reader.h"

namespace peeler::cmd {

class VerbOptions;

struct CameraOptions : CameraChoice {
    bool size_given = false;      ///< the size was asked for
    std::optional<Shard> tile{};  ///< of the rows of the crop, or of the picture
};

/// Declares --camera, --eye, … --crop. --up of a verb that reads a scene may be an axis of the
/// scene's file, too, for `reading`. What is referred to must outlive the parse.
void addCameraOptions(VerbOptions& verb, CameraOptions& options,
                      SceneReadOptions* reading = nullptr);

/// Like the other makeView(), with the tile.
View makeView(const PosedScene& posed, const SceneExtent& extent, const CameraOptions& options);

}  // namespace peeler::cmd
