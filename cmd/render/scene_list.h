// SPDX-License-Identifier: Apache-2.0
// The list of scenes to render: files, folders, globs.
#pragma once

#include <vector>

#include "cmd/render/render_options.h"

namespace peeler::cmd {

/// Returns the options for each scene of listScenes(), with namedAfter() applied to the names of
/// the output, the manifest and the cameras. If several scenes go into shards, a chunk selects
/// scenes instead of pictures. Throws like listScenes() and SceneOutputs::take().
std::vector<RenderOptions> eachScene(const RenderOptions& options);

}  // namespace peeler::cmd
