// SPDX-License-Identifier: Apache-2.0
// KHR_materials_variants: other materials for the same meshes.
#pragma once

#include <tiny_gltf.h>

#include <nlohmann/json_fwd.hpp>
#include <string>
#include <vector>

namespace peeler {

/// The names of the variants of a file that has passed checkGltfSchema(), in its order.
std::vector<std::string> readVariantNames(const nlohmann::json& gltf);

/// For each of `count` variants the material of this primitive, −1 where it names none; empty if it
/// names none at all. If two mappings name the same variant, the first counts.
std::vector<int> variantMaterials(const tinygltf::Primitive& primitive, std::size_t count);

}  // namespace peeler
