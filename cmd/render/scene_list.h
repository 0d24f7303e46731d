// SPDX-License-Identifier: Apache-2.0
// Scene lists of peeler render: files, folders, globs.
#pragma once

#include <vector>

#include "cmd/render/render_options.h"

namespace peeler::cmd {

/// Returns the options of each scene in `options.scenes`: files, every isSceneName() in and below
/// folders, and matches of globs; each group is sorted by name. In the names of the output, the
/// manifest and the cameras, {stem} is the scene's name without extension and {folder} its folder's
/// name; sample keys replace dots by underscores. With several scenes in shards, a chunk selects
/// scenes instead of pictures. Throws Error (kInput) if there is no scene, Error (kUsage) if two
/// would write the same file.
std::vector<RenderOptions> eachScene(const RenderOptions& options);

}  // namespace peeler::cmd
