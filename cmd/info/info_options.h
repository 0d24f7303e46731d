// SPDX-License-Identifier: Apache-2.0
// The options of peeler info.
#pragma once

#include <filesystem>

#include "cmd/options/layered_options.h"
#include "cmd/session/scene_request.h"

namespace peeler::cmd {

struct InfoOptions {
    std::filesystem::path file;
    bool json = false;
    SceneOptions scene;
    AppearanceOptions appearance;
    /// Options for an image. `strict` is ignored; `scene.reading.strict` applies to images, too.
    LayeredReadOptions image;
};

}  // namespace peeler::cmd
