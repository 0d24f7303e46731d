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
    SceneOptions scene;  ///< the part of a scene that is described, and how it is read
    AppearanceOptions appearance;
    LayeredReadOptions image;  ///< of an image; `strict` is that of the scene
};

}  // namespace peeler::cmd
