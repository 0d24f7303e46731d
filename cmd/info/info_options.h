// SPDX-License-Identifier: Apache-2.0
// The options of peeler info.
#pragma once

#include <filesystem>

#include "cmd/options/layered_options.h"
#include "formats/meshes/scene_reader.h"

namespace peeler::cmd {

struct InfoOptions {
    std::filesystem::path file;
    bool json = false;
    SceneReadOptions reading;  ///< of a scene
    LayeredReadOptions image;  ///< of an image; `strict` is that of `reading`
};

}  // namespace peeler::cmd
