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
    SceneOptions scene;  ///< scene selection and reading
    AppearanceOptions appearance;
    LayeredReadOptions image;  ///< for an image; `strict` is in `scene`
};

}  // namespace peeler::cmd
