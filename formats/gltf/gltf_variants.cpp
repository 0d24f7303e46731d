// SPDX-License-Identifier: Apache-2.0
// Material variants of a glTF file (KHR_materials_variants).
#include "formats/gltf/gltf_parts.h"

#include <nlohmann/json.hpp>

namespace peeler {

std::vector<std::string> readVariantNames(const nlohmann::json& gltf) {
    std::vector<std::string> names;
    const nlohmann::json::json_pointer variants("/extensions/KHR_materials_variants/variants");
    if (gltf.contains(variants))
        for (const auto& variant : gltf[variants])
            names.push_back(variant["name"].get<std::string>());
    return names;
}

std::vector<int> variantMaterials(const tinygltf::Primitive& primitive, std::size_t count) {
    const auto found = primitive.extensions.find("KHR_materials_variants");
    if (found == primitive.extensions.end()) return {};
    std::vector<int> materials(count, -1);
    const tinygltf::Value& mappings = found->second.Get("mappings");
    for (std::size_t i = 0; i < mappings.ArrayLen(); ++i) {
        const tinygltf::Value& mapping = mappings.Get(static_cast<int>(i));
        const tinygltf::Value& variants = mapping.Get("variants");
        for (std::size_t j = 0; j < variants.ArrayLen(); ++j) {
            const auto variant =
                static_cast<std::size_t>(variants.Get(static_cast<int>(j)).GetNumberAsInt());
            int& material = materials.at(variant);
            if (material < 0) material = mapping.Get("material").GetNumberAsInt();
        }
    }
    return materials;
}

}  // namespace peeler
