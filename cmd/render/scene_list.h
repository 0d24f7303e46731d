// SPDX-License-Identifier: Apache-2.0
// The scenes that a run of peeler render names: files, folders, globs.
#pragma once

#include <vector>

#include "cmd/render/render_options.h"

namespace peeler::cmd {

/// The options of each scene that `options.scenes` names: of files themselves, of folders every
/// isSceneName() in and below them, of globs what they match, each group by name. In the names of
/// the output, the manifest and the cameras {stem} stands for the scene's name without its
/// extension, {folder} for that of its folder; in keys of samples with underscores for dots. Of
/// several scenes in shards those that a chunk has, which is none of their pictures then. Throws
/// Error (kInput) if there is no scene, (kUsage) if two would write the same file.
std::vector<RenderOptions> eachScene(const RenderOptions& options);

}  // namespace peeler::cmd
