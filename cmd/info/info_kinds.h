// SPDX-License-Identifier: Apache-2.0
// What `peeler info` says of each kind of file.
#pragma once

#include <filesystem>

#include "cmd/cli/console.h"

namespace peeler::cmd {

struct InfoOptions {
    std::filesystem::path file;
    bool json = false;
    bool allow_outside = false;  ///< of a scene: GltfOptions
};

/// The node tree, what is drawn, materials, cameras, bounds, extensions, warnings.
void printSceneInfo(const InfoOptions& options, Console& console);

/// Windows, layers with their pixels, completeness, where the picture comes from.
void printImageInfo(const InfoOptions& options, Console& console);

}  // namespace peeler::cmd
