// SPDX-License-Identifier: Apache-2.0
// glTF material extensions: a function and a row in the table for each.
#include "formats/gltf/gltf_parts.h"

#include <algorithm>
#include <limits>

#include <peeler/gltf_options.h>
#include "formats/gltf/gltf_document.h"

namespace peeler {
namespace {

constexpr float kNoLimit = std::numeric_limits<float>::max();

/// A reader of the members of an extension object. A missing member leaves its target unchanged.
class Members {
  public:
    Members(const tinygltf::Value& object, std::string where, GltfDocument& document,
            const ReadTexture& read_texture)
        : object_(object),
          where_(std::move(where)),
          document_(document),
          read_texture_(read_texture) {}

    void number(const char* name, float& target, float least = 0, float most = 1) const {
        if (const auto* value = findMember(object_, name))
            target = within(value->GetNumberAsDouble(), name, least, most);
    }

    template <glm::length_t n>
    void color(const char* name, glm::vec<n, float>& target, float most = 1) const {
        const auto* value = findMember(object_, name);
        if (!value) return;
        for (int c = 0; c < n; ++c)
            target[c] = within(value->Get(c).GetNumberAsDouble(), name, 0, most);
    }

    void texture(const char* name, TextureRef& target, float* scale = nullptr) const {
        const auto* value = findMember(object_, name);
        if (!value) return;
        tinygltf::TextureInfo info;
        info.index = value->Get("index").GetNumberAsInt();
        if (const auto* texcoord = findMember(*value, "texCoord"))
            info.texCoord = texcoord->GetNumberAsInt();
        if (const auto* extensions = findMember(*value, "extensions"))
            info.extensions = extensions->Get<tinygltf::Value::Object>();
        if (const auto* factor = findMember(*value, "scale"); factor && scale)
            *scale = static_cast<float>(factor->GetNumberAsDouble());
        target = read_texture_(info, where_ + '/' + name);
    }

  private:
    float within(double value, const char* name, float least, float most) const {
        if (value < least || value > most)
            document_.warn("The value " + where_ + '/' + name +
                           " is out of its range; it is clamped.");
        return std::clamp(static_cast<float>(value), least, most);
    }

    const tinygltf::Value& object_;
    std::string where_;
    GltfDocument& document_;
    const ReadTexture& read_texture_;
};

void readEmissiveStrength(const Members& from, Material& m) {
    float strength = 1;
    from.number("emissiveStrength", strength, 0, kNoLimit);
    m.emissive *= strength;
}

void readIor(const Members& from, Material& m) {
    from.number("ior", m.ior, 0, kNoLimit);
    if (m.ior != 0) from.number("ior", m.ior, 1, kNoLimit);
}

void readSpecular(const Members& from, Material& m) {
    from.number("specularFactor", m.specular.factor);
    from.texture("specularTexture", m.specular.texture);
    from.color("specularColorFactor", m.specular.color, kNoLimit);
    from.texture("specularColorTexture", m.specular.color_texture);
}

void readClearcoat(const Members& from, Material& m) {
    from.number("clearcoatFactor", m.clearcoat.factor);
    from.texture("clearcoatTexture", m.clearcoat.texture);
    from.number("clearcoatRoughnessFactor", m.clearcoat.roughness);
    from.texture("clearcoatRoughnessTexture", m.clearcoat.roughness_texture);
    from.texture("clearcoatNormalTexture", m.clearcoat.normal_texture, &m.clearcoat.normal_scale);
}

void readSheen(const Members& from, Material& m) {
    from.color("sheenColorFactor", m.sheen.color);
    from.texture("sheenColorTexture", m.sheen.color_texture);
    from.number("sheenRoughnessFactor", m.sheen.roughness);
    from.texture("sheenRoughnessTexture", m.sheen.roughness_texture);
}

void readAnisotropy(const Members& from, Material& m) {
    from.number("anisotropyStrength", m.anisotropy.strength);
    from.number("anisotropyRotation", m.anisotropy.rotation, -kNoLimit, kNoLimit);
    from.texture("anisotropyTexture", m.anisotropy.texture);
}

void readIridescence(const Members& from, Material& m) {
    from.number("iridescenceFactor", m.iridescence.factor);
    from.texture("iridescenceTexture", m.iridescence.texture);
    from.number("iridescenceIor", m.iridescence.ior, 1, kNoLimit);
    from.number("iridescenceThicknessMinimum", m.iridescence.thickness_min, 0, kNoLimit);
    from.number("iridescenceThicknessMaximum", m.iridescence.thickness_max, 0, kNoLimit);
    from.texture("iridescenceThicknessTexture", m.iridescence.thickness_texture);
}

void readTransmission(const Members& from, Material& m) {
    from.number("transmissionFactor", m.transmission.factor);
    from.texture("transmissionTexture", m.transmission.texture);
}

void readVolume(const Members& from, Material& m) {
    from.number("thicknessFactor", m.transmission.thickness, 0, kNoLimit);
    from.texture("thicknessTexture", m.transmission.thickness_texture);
    from.number("attenuationDistance", m.transmission.attenuation_distance, 0, kNoLimit);
    from.color("attenuationColor", m.transmission.attenuation_color);
}

void readSpecularGlossiness(const Members& from, Material& m) {
    SpecularGlossiness& sg = m.specular_glossiness.emplace();
    m.base_color = glm::vec4(1);
    m.base_color_texture = {};
    from.color("diffuseFactor", m.base_color);
    from.texture("diffuseTexture", m.base_color_texture);
    from.color("specularFactor", sg.specular);
    from.number("glossinessFactor", sg.glossiness);
    from.texture("specularGlossinessTexture", sg.texture);
}

struct Reader {
    const char* name;
    void (*read)(const Members&, Material&);
    enum Condition { kAlways, kLit, kTransmission } condition = kLit;
};
constexpr Reader kReaders[] = {
    {"KHR_materials_emissive_strength", readEmissiveStrength, Reader::kAlways},
    {"KHR_materials_pbrSpecularGlossiness", readSpecularGlossiness},
    {"KHR_materials_ior", readIor},
    {"KHR_materials_specular", readSpecular},
    {"KHR_materials_clearcoat", readClearcoat},
    {"KHR_materials_sheen", readSheen},
    {"KHR_materials_anisotropy", readAnisotropy},
    {"KHR_materials_iridescence", readIridescence},
    {"KHR_materials_transmission", readTransmission, Reader::kTransmission},
    {"KHR_materials_volume", readVolume, Reader::kTransmission},
};

}  // namespace

const tinygltf::Value* findMember(const tinygltf::Value& object, const char* name) {
    return object.Has(name) ? &object.Get(name) : nullptr;
}

const tinygltf::Value* findExtension(const tinygltf::ExtensionMap& extensions, const char* name) {
    const auto found = extensions.find(name);
    return found == extensions.end() ? nullptr : &found->second;
}

void readMaterialExtensions(const tinygltf::Material& source, const std::string& where,
                            const GltfOptions& options, GltfDocument& document,
                            const ReadTexture& read_texture, Material& material) {
    material.unlit = findExtension(source.extensions, "KHR_materials_unlit") != nullptr;
    for (const Reader& reader : kReaders) {
        const auto* extension = findExtension(source.extensions, reader.name);
        if (!extension || (material.unlit && reader.condition != Reader::kAlways)) continue;
        if (reader.condition == Reader::kTransmission && !options.transmission) continue;
        reader.read(
            Members(*extension, where + "/extensions/" + reader.name, document, read_texture),
            material);
    }
    // If a factor is zero, the extension's textures need not be decoded.
    Material none;
    if (material.clearcoat.factor == 0) material.clearcoat = none.clearcoat;
    if (material.sheen.color == glm::vec3(0)) material.sheen = none.sheen;
    if (material.anisotropy.strength == 0) material.anisotropy = none.anisotropy;
    if (material.iridescence.factor == 0) material.iridescence = none.iridescence;
    if (material.transmission.factor == 0) material.transmission = none.transmission;
}

}  // namespace peeler
