// SPDX-License-Identifier: Apache-2.0
// The Clipping options, and the resulting clip volume.
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

/// Throws Error (kUsage) if the options contradict each other, regardless of the scene.
void checkClipOptions(const ClipOptions& options);

/// Returns the volume, with the named nodes and their visible descendants. Throws Error (kUsage) if
/// a node does not exist (with the list) or has no triangles.
ClipVolume clipVolume(const ClipOptions& options, const PosedScene& posed);

}  // namespace peeler::cmd
