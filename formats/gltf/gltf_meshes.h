// SPDX-License-Identifier: Apache-2.0
// glTF meshes to the scene's: vertex attributes, indices, topology.
#pragma once

#include "core/scene/scene.h"
#include "formats/gltf/gltf_document.h"

namespace peeler {

/// All meshes of the document, in order. Primitives without a material get `default_material`.
/// Primitives that draw nothing are left out with a warning.
std::vector<Mesh> readGltfMeshes(GltfDocument& document, const GltfOptions& options,
                                 int default_material);

}  // namespace peeler
