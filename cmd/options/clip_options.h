// SPDX-License-Identifier: Apache-2.0
// The options under the heading Clipping, and the resulting clip volume.
#pragma once

#include <string>
#include <vector>

#include <peeler/clip.h>
#include "core/scene/posed_scene.h"

namespace peeler::cmd {

class VerbOptions;

/// The values of --clip-box, --clip-plane, --clip-mesh and --clip.
struct ClipOptions {
    ClipVolume volume;                ///< without its `nodes`
    std::vector<std::string> meshes;  ///< names or indices of nodes
    bool side_given = false;
};

/// Declares the options; `options` must outlive the parse.
void addClipOptions(VerbOptions& verb, ClipOptions& options);

/// Throws Error (kUsage) if the options contradict each other. Does not need the scene.
void checkClipOptions(const ClipOptions& options);

/// Returns the clip volume, including the named nodes and their descendants. Throws Error (kUsage)
/// if a node does not exist (the message lists the nodes) or shows no triangles.
ClipVolume clipVolume(const ClipOptions& options, const PosedScene& posed);

}  // namespace peeler::cmd
