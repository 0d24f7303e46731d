// SPDX-License-Identifier: Apache-2.0
// The lights of a glTF file (KHR_lights_punctual).
#pragma once

#include <nlohmann/json_fwd.hpp>

namespace peeler {

struct GltfDocument;

/// Fills `lights` and `node_lights` of the document from JSON that has passed checkGltfSchema().
/// A light of unknown type is left out with a warning, as the extension's schema has it.
/// Throws Error(kInput) with a JSON pointer for what the schema's table cannot say: negative
/// colours and intensities, cones that are inside out or wider than a half space, a spot light
/// without `spot`.
void readGltfLights(const nlohmann::json& gltf, GltfDocument& document);

}  // namespace peeler
