// SPDX-License-Identifier: Apache-2.0
// The list of scenes to render: files, folders, globs.
#pragma once

#include <vector>

#include "cmd/render/render_options.h"

namespace peeler::cmd {

/// Returns the options for each scene in `options.scenes`. An entry is a file, a folder or a glob.
/// A folder means all files in and below it that isSceneName() accepts. Matches of a folder or glob
/// are sorted by name. In the names of the output, the manifest and the cameras, {stem} is the
/// scene's name without extension and {folder} its folder's name; in sample keys, underscores
/// replace dots, #, % and @. If several scenes go into shards, a chunk selects scenes instead of
/// pictures. Throws Error (kInput) if there is no scene, Error (kUsage) if two scenes would write
/// the same file.
std::vector<RenderOptions> eachScene(const RenderOptions& options);

}  // namespace peeler::cmd
