// SPDX-License-Identifier: Apache-2.0
// Camera and picture options, and the resulting View.
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
    bool size_given = false;
    /// --tile: a strip of rows of the crop or, without a crop, of the picture.
    std::optional<Shard> tile{};
};

/// Declares --camera, --eye, … --crop. If `reading` is not null, --up may also name an axis of the
/// scene file, and the axis is stored in `reading`. `lenses`: whether the verb takes lenses, with
/// which the field of view may exceed 180°. All arguments must outlive the parse.
void addCameraOptions(VerbOptions& verb, CameraOptions& options,
                      SceneReadOptions* reading = nullptr, bool lenses = false);

/// Returns the view of the overload for CameraChoice, cropped to the tile.
View makeView(const PosedScene& posed, const SceneExtent& extent, const CameraOptions& options);

}  // namespace peeler::cmd
