// SPDX-License-Identifier: Apache-2.0
// The nodes of a glTF file, their skins and instances.
#pragma once

#include "core/scene/scene.h"
#include "formats/gltf/gltf_document.h"

namespace peeler {

/// Fills `nodes` and `skins` of the scene, whose meshes are there already.
/// Throws Error(kInput) with a JSON pointer: joints that a skin does not have, inverse bind
/// matrices and instance attributes of the wrong number or format.
void readGltfNodes(GltfDocument& document, const GltfOptions& options, Scene& scene);

}  // namespace peeler
