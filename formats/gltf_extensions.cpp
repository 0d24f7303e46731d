// SPDX-License-Identifier: Apache-2.0
// The table of glTF extensions: what is supported, and what is lost where one is ignored.
#include <algorithm>

#include "formats/gltf_reader.h"

namespace peeler {

const std::vector<GltfExtension>& gltfExtensions() {
    static const std::vector<GltfExtension> extensions = {
        {"EXT_mesh_gpu_instancing", true, "a mesh at many places"},
        {"EXT_meshopt_compression", true, "meshopt-compressed buffers"},
        {"EXT_texture_avif", false, "the PNG or JPEG fallback is read"},
        {"EXT_texture_webp", true, "WebP textures"},
        {"KHR_animation_pointer", false, "only nodes and morph weights are animated"},
        {"KHR_draco_mesh_compression", true, "Draco-compressed meshes"},
        {"KHR_lights_punctual", true, "directional, point and spot lights"},
        {"KHR_materials_anisotropy", false, "materials are shaded without it"},
        {"KHR_materials_clearcoat", false, "materials are shaded without it"},
        {"KHR_materials_dispersion", false, "materials are shaded without it"},
        {"KHR_materials_emissive_strength", true, "emission brighter than 1"},
        {"KHR_materials_ior", false, "materials are shaded without it"},
        {"KHR_materials_iridescence", false, "materials are shaded without it"},
        {"KHR_materials_pbrSpecularGlossiness", false, "the metallic-roughness fallback is shaded"},
        {"KHR_materials_sheen", false, "materials are shaded without it"},
        {"KHR_materials_specular", false, "materials are shaded without it"},
        {"KHR_materials_transmission", false, "transmissive surfaces are shaded as opaque ones"},
        {"KHR_materials_unlit", true, "materials without lighting"},
        {"KHR_materials_variants", false, "the default variant is shown"},
        {"KHR_materials_volume", false, "materials are shaded without it"},
        {"KHR_mesh_quantization", true, "vertex attributes stored as small integers"},
        {"KHR_meshopt_compression", true, "meshopt-compressed buffers"},
        {"KHR_node_visibility", true, "hidden nodes"},
        {"KHR_texture_basisu", false, "the PNG or JPEG fallback is read"},
        {"KHR_texture_transform", true, "offset, rotation and scale of texture coordinates"},
        {"MSFT_texture_dds", false, "the PNG or JPEG fallback is read"},
    };
    return extensions;
}

const std::vector<GltfExtension>& supportedGltfExtensions() {
    static const auto supported = [] {
        std::vector<GltfExtension> result;
        std::copy_if(gltfExtensions().begin(), gltfExtensions().end(), std::back_inserter(result),
                     [](const GltfExtension& extension) { return extension.supported; });
        return result;
    }();
    return supported;
}

}  // namespace peeler
