// SPDX-License-Identifier: Apache-2.0
// The animations of a glTF file.
#pragma once

#include "core/scene/scene.h"
#include "formats/gltf/gltf_document.h"

namespace peeler {

/// All animations of the document, for nodes and meshes that `scene` has already. Channels that
/// move nothing known to us are left out with a warning.
/// Throws Error(kInput) with a JSON pointer: times that are not finite or fall, values whose number
/// or format does not fit the times or the property, more keys than the geometry limit has bytes
/// for (many samplers may share the same bytes of a small file).
std::vector<Animation> readGltfAnimations(GltfDocument& document, const GltfOptions& options,
                                          const Scene& scene);

}  // namespace peeler
