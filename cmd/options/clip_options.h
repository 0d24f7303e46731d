// SPDX-License-Identifier: Apache-2.0
// The options of the group Clipping, and the volume that they make.
#pragma once

#include <string>
#include <vector>

#include <peeler/clip.h>
#include "core/scene/posed_scene.h"

namespace peeler::cmd {

class VerbOptions;

/// --clip-box, --clip-plane, --clip-mesh and --clip.
struct ClipOptions {
    ClipVolume volume;                ///< without nodes
    std::vector<std::string> meshes;  ///< names or indices of nodes
    bool side_given = false;          ///< --clip is given
};

/// Declares the options; `options` must outlive the parse.
void addClipOptions(VerbOptions& verb, ClipOptions& options);

/// Throws Error (kUsage) for what contradicts itself whatever the scene is.
void checkClipOptions(const ClipOptions& options);

/// The volume with the nodes that are shown under the named ones. Throws Error (kUsage) for a node
/// that is not there, with the list, and for one without triangles.
ClipVolume clipVolume(const ClipOptions& options, const PosedScene& posed);

}  // namespace peeler::cmd
