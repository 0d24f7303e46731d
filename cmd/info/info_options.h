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
    SceneOptions scene;  ///< options for a scene
    AppearanceOptions appearance;
    LayeredReadOptions image;  ///< options for an image, except `strict`, which is that of `scene`
};

}  // namespace peeler::cmd
