// SPDX-License-Identifier: Apache-2.0
// Table of glTF extensions: supported extensions, and the effects of ignoring others.
#include <algorithm>

#include "formats/gltf/gltf_reader.h"

namespace peeler {

const std::vector<GltfExtension>& gltfExtensions() {
    static const std::vector<GltfExtension> extensions = {
        {"EXT_mesh_gpu_instancing", true, "instances of a mesh"},
        {"EXT_meshopt_compression", true, "meshopt-compressed buffers"},
        {"EXT_texture_avif", false, "the PNG or JPEG fallback is read", true},
        {"EXT_texture_webp", true, "WebP textures"},
        {"KHR_animation_pointer", false, "only nodes and morph weights are animated"},
        {"KHR_draco_mesh_compression", true, "Draco-compressed meshes"},
        {"KHR_gaussian_splatting", true, "Gaussian splats"},
        {"KHR_lights_punctual", true, "directional, point and spot lights"},
        {"KHR_materials_anisotropy", true, "highlights stretched along a direction"},
        {"KHR_materials_clearcoat", true, "a varnish with its own normals"},
        {"KHR_materials_dispersion", false,
         "light is not refracted, so it is not split into colours"},
        {"KHR_materials_emissive_strength", true, "emission brighter than 1"},
        {"KHR_materials_ior", true, "index of refraction of dielectrics"},
        {"KHR_materials_iridescence", true, "thin films"},
        {"KHR_materials_pbrSpecularGlossiness", true,
         "diffuse, specular and glossiness in place of metallic-roughness"},
        {"KHR_materials_sheen", true, "the back-scattering of fibres"},
        {"KHR_materials_specular", true, "strength and tint of reflections"},
        {"KHR_materials_transmission", true,
         "transmitted light, as alpha of the layer; without refraction"},
        {"KHR_materials_unlit", true, "materials without lighting"},
        {"KHR_materials_variants", true, "alternative materials for the meshes; one can be chosen"},
        {"KHR_materials_volume", true, "thickness tints transmitted light; without refraction"},
        {"KHR_mesh_quantization", true, "vertex attributes stored as small integers"},
        {"KHR_meshopt_compression", true, "meshopt-compressed buffers"},
        {"KHR_node_visibility", true, "hidden nodes"},
        {"KHR_texture_basisu", true, "KTX2 textures of UASTC and ETC1S"},
        {"KHR_texture_transform", true, "offset, rotation and scale of texture coordinates"},
        {"KHR_xmp", true, "metadata, which does not change the picture"},
        {"KHR_xmp_json_ld", true, "metadata, which does not change the picture"},
        {"MSFT_texture_dds", false, "the PNG or JPEG fallback is read", true},
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

std::vector<std::string> undecodedImageExtensions() {
    std::vector<std::string> names;
    for (const GltfExtension& extension : gltfExtensions())
        if (extension.undecoded_images) names.emplace_back(extension.name);
    return names;
}

}  // namespace peeler
