// SPDX-License-Identifier: Apache-2.0
// glTF materials and the textures that they use.
#pragma once

#include "core/scene/scene.h"
#include "formats/gltf/gltf_document.h"

namespace peeler {

/// Fills scene.materials (the file's in order, then glTF's default material) and scene.images
/// (those that a material uses, each once). An image that cannot be had is a warning and the
/// material goes without it; under options.strict it throws Error(kInput) with the image's JSON
/// pointer.
void readGltfMaterials(GltfDocument& document, const GltfOptions& options, Scene& scene);

}  // namespace peeler
