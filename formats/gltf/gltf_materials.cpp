// SPDX-License-Identifier: Apache-2.0
// Reader of glTF materials and their textures.
#include "formats/gltf/gltf_parts.h"

#include <algorithm>
#include <atomic>
#include <cmath>
#include <optional>

#include <peeler/error.h>
#include "core/base/parallel.h"
#include "core/base/process_memory.h"
#include "core/scene/material.h"
#include "formats/gltf/gltf_accessor.h"
#include "formats/gltf/gltf_decoders.h"
#include "formats/gltf/gltf_reader.h"
#include "formats/gltf/gltf_schema.h"

namespace peeler {
namespace {

/// Reads a numeric array. Leaves `numbers` unchanged if the array is missing. The schema check has
/// checked type and length.
template <std::size_t n>
void readNumbers(const tinygltf::Value& object, const char* name, std::array<double, n>& numbers) {
    if (!object.Has(name)) return;
    const tinygltf::Value& array = object.Get(name);
    for (std::size_t i = 0; i < n && i < array.ArrayLen(); ++i)
        numbers[i] = array.Get(static_cast<int>(i)).GetNumberAsDouble();
}

/// Returns the matrix of KHR_texture_transform: translation · rotation · scale. Angles are
/// counter-clockwise as seen in the picture, where v points down.
glm::mat3 textureTransform(const tinygltf::Value& extension) {
    std::array<double, 2> offset = {0, 0}, scale = {1, 1};
    readNumbers(extension, "offset", offset);
    readNumbers(extension, "scale", scale);
    const double angle =
        extension.Has("rotation") ? extension.Get("rotation").GetNumberAsDouble() : 0;
    const double c = std::cos(angle), s = std::sin(angle);
    return glm::mat3(glm::dmat3(c * scale[0], -s * scale[0], 0,  //
                                s * scale[1], c * scale[1], 0,   //
                                offset[0], offset[1], 1));
}

Sampler toSampler(const tinygltf::Model& model, const tinygltf::Texture& texture) {
    Sampler result;
    if (texture.sampler < 0) return result;
    const tinygltf::Sampler& source = model.samplers[static_cast<std::size_t>(texture.sampler)];
    if (source.magFilter >= 0) result.mag_filter = source.magFilter;
    if (source.minFilter >= 0) result.min_filter = source.minFilter;
    result.wrap_s = source.wrapS;
    result.wrap_t = source.wrapT;
    return result;
}

class MaterialReader {
  public:
    MaterialReader(GltfDocument& document, const GltfOptions& options, Scene& scene)
        : document_(document),
          options_(options),
          scene_(scene),
          places_(document.images.size(), -1) {}

    void read() {
        const std::vector<tinygltf::Material>& sources = document_.model.materials;
        for (std::size_t i = 0; i < sources.size(); ++i)
            scene_.materials.push_back(material(sources[i], childPointer("/materials", i)));
        scene_.materials.push_back({});
        scene_.materials.back().name = "default";
        decodeImages();
    }

  private:
    Material material(const tinygltf::Material& source, const std::string& where) {
        const tinygltf::PbrMetallicRoughness& pbr = source.pbrMetallicRoughness;
        Material out;
        out.name = source.name;
        for (int i = 0; i < 4; ++i)
            out.base_color[i] = factor(pbr.baseColorFactor[static_cast<std::size_t>(i)], where);
        out.metallic = factor(pbr.metallicFactor, where);
        out.roughness = factor(pbr.roughnessFactor, where);
        const std::string pbr_where = where + "/pbrMetallicRoughness";
        out.base_color_texture = texture(pbr.baseColorTexture, pbr_where + "/baseColorTexture");
        out.metallic_roughness_texture =
            texture(pbr.metallicRoughnessTexture, pbr_where + "/metallicRoughnessTexture");
        out.normal_texture = texture(source.normalTexture, where + "/normalTexture");
        out.normal_scale = static_cast<float>(source.normalTexture.scale);
        out.occlusion_texture = texture(source.occlusionTexture, where + "/occlusionTexture");
        out.occlusion_strength = factor(source.occlusionTexture.strength, where);
        out.emissive_texture = texture(source.emissiveTexture, where + "/emissiveTexture");
        for (int i = 0; i < 3; ++i)
            out.emissive[i] = factor(source.emissiveFactor[static_cast<std::size_t>(i)], where);
        out.alpha_mode = source.alphaMode == "MASK"    ? AlphaMode::kMask
                         : source.alphaMode == "BLEND" ? AlphaMode::kBlend
                                                       : AlphaMode::kOpaque;
        out.alpha_cutoff = static_cast<float>(source.alphaCutoff);
        out.double_sided = source.doubleSided;
        readMaterialExtensions(
            source, where, options_, document_,
            [this](const tinygltf::TextureInfo& info, const std::string& place) {
                return texture(info, place);
            },
            out);
        return out;
    }

    /// Clamps a factor to 0–1 (§5.19, §5.22). Alpha and composites would be meaningless with other
    /// values.
    float factor(double value, const std::string& where) {
        if (value < 0 || value > 1)
            document_.warn("The material " + where +
                           " has factors outside 0 to 1; they are "
                           "clamped.");
        return static_cast<float>(std::clamp(value, 0.0, 1.0));
    }

    /// Converts a texture reference. `Info` is tinygltf's TextureInfo, NormalTextureInfo or
    /// OcclusionTextureInfo.
    template <typename Info>
    TextureRef texture(const Info& info, const std::string& where) {
        TextureRef out;
        if (info.index < 0) return out;
        const tinygltf::Texture& source =
            document_.model.textures[static_cast<std::size_t>(info.index)];
        out.sampler = toSampler(document_.model, source);
        out.texcoord = info.texCoord;
        if (const auto* transform = findExtension(info.extensions, "KHR_texture_transform")) {
            out.transform = textureTransform(*transform);
            if (transform->Has("texCoord"))
                out.texcoord = transform->Get("texCoord").GetNumberAsInt();
        }
        if (out.texcoord > 1) {
            document_.warn("The texture reference " + where + " uses TEXCOORD_" +
                           std::to_string(out.texcoord) +
                           "; only 0 and 1 are supported, 0 is used.");
            out.texcoord = 0;
        }
        out.image =
            imageOf(source, childPointer("/textures", static_cast<std::size_t>(info.index)));
        return out;
    }

    /// Returns the index of the texture's image in used_images_. An extension's image in a format
    /// that peeler decodes takes precedence over the texture's own image, which becomes the
    /// fallback. Returns −1, with a warning, if there is no image.
    int imageOf(const tinygltf::Texture& source, const std::string& where) {
        for (const char* name : {"EXT_texture_webp", "KHR_texture_basisu"})
            if (const auto* extension = findExtension(source.extensions, name);
                extension && extension->Has("source"))
                return sceneImage(extension->Get("source").GetNumberAsInt(), source.source);
        if (source.source >= 0) return sceneImage(source.source);
        for (const std::string& name : undecodedImageExtensions()) {
            if (!findExtension(source.extensions, name.c_str())) continue;
            const std::string place = childPointer(where + "/extensions", name);
            if (std::ranges::find(options_.ignored_extensions, name) !=
                options_.ignored_extensions.end()) {
                missing(place, "its only image needs " + name, "add a PNG or JPEG image");
                return -1;
            }
            throw Error(ErrorKind::kInput,
                        "the texture's only image needs " + name + ", which is not supported",
                        place,
                        "add a PNG or JPEG fallback, or go on without the texture: " +
                            Parameter::kIgnoredExtensions + " " + name);
        }
        missing(where, "it has no image", "add a PNG or JPEG image");
        return -1;
    }

    /// Returns the index in used_images_ of an image of the file. The first call for an image adds
    /// it.
    int sceneImage(int image, int fallback = -1) {
        int& place = places_[static_cast<std::size_t>(image)];
        if (place < 0) {
            place = static_cast<int>(used_images_.size());
            used_images_.push_back(image);
            fallbacks_.push_back(-1);
        }
        if (fallback >= 0) fallbacks_[static_cast<std::size_t>(place)] = fallback;
        return place;
    }

    void missing(const std::string& where, const Text& why, const Text& hint) {
        document_.warnings.warn("The texture " + where + " is left out: " + why + ".",
                                Error(ErrorKind::kInput, why, where, hint));
    }

    std::span<const std::uint8_t> imageBytes(int image) {
        const auto index = static_cast<std::size_t>(image);
        const std::string where = childPointer("/images", index);
        const GltfDocument::ImageSource& source = document_.images[index];
        if (source.buffer_view >= 0)
            return AccessorReader(document_).bufferView(source.buffer_view);
        if (source.uri.empty())
            throw Error(ErrorKind::kInput, "the image has neither a uri nor a bufferView", where);
        return document_.readUri(source.uri, where + "/uri");
    }

    /// A decoded image, or the reason why it could not be decoded.
    struct Decoded {
        DecodedTexture texture;
        std::optional<Error> problem;
    };

    /// Decodes the images of used_images_ from index `first` on.
    void decodeFrom(std::size_t first) {
        // Read files in order, because the hash depends on the order. Decode in parallel, because
        // decoding is slow.
        decoded_.resize(used_images_.size());
        std::vector<std::span<const std::uint8_t>> bytes(used_images_.size());
        for (std::size_t i = first; i < used_images_.size(); ++i) {
            try {
                bytes[i] = imageBytes(used_images_[i]);
            } catch (const Error& problem) {
                decoded_[i].problem = problem;
            }
        }
        const std::uint64_t used = usedBytes(document_.memory.budget());
        std::atomic<std::uint64_t> decoded = 0;
        parallelFor(used_images_.size() - first, [&](std::size_t item) {
            Decoded& out = decoded_[first + item];
            if (out.problem) return;
            const auto& source =
                document_.images[static_cast<std::size_t>(used_images_[first + item])];
            const auto allow = [&](std::uint64_t more) {
                checkReadingMemory(document_.memory.budget(), used + (decoded += more),
                                   pointerOf(first + item));
            };
            try {
                out.texture = decodeTexture(
                    bytes[first + item], source.name.empty() ? shortUri(source.uri) : source.name,
                    {options_.max_image_dimension, options_.max_image_bytes, allow});
            } catch (const Error& problem) {
                out.problem = problem;
            }
        });
    }

    void decodeImages() {
        decodeFrom(0);
        // Only the images that failed to decode need their fallbacks.
        const std::size_t count = used_images_.size();
        std::vector<int> stand_ins(count, -1);
        for (std::size_t i = 0; i < count; ++i)
            if (decoded_[i].problem && fallbacks_[i] >= 0 && !options_.strict)
                stand_ins[i] = sceneImage(fallbacks_[i]);
        decodeFrom(count);

        std::vector<int> place(used_images_.size(), -1);
        for (std::size_t i = 0; i < used_images_.size(); ++i) {
            const std::optional<Error>& problem = decoded_[i].problem;
            if (!problem) {
                place[i] = static_cast<int>(scene_.images.size());
                scene_.images.push_back(std::move(decoded_[i].texture.image));
                if (!decoded_[i].texture.in_gltf)
                    document_.warn("The image " + pointerOf(i) + " is a " +
                                       scene_.images.back().codec +
                                       ", which glTF does not allow (IMAGE_UNRECOGNIZED_FORMAT); "
                                       "it is used anyway.",
                                   pointerOf(i));
                for (const std::string& note : decoded_[i].texture.notes)
                    document_.warn("The image " + pointerOf(i) + ": " + note + ".");
                continue;
            }
            if (problem->kind() != ErrorKind::kInput) throw Error(*problem);
            const std::string where = pointerOf(i);
            if (i >= count || stand_ins[i] < 0)
                missing(where, problem->whatText(), problem->hintText());
            else
                document_.warn("The fallback image is used because the image " + where +
                               " cannot be read: " + problem->whatText() + ".");
        }
        for (std::size_t i = 0; i < count; ++i)
            if (stand_ins[i] >= 0) place[i] = place[static_cast<std::size_t>(stand_ins[i])];
        for (Material& material : scene_.materials)
            for (const MaterialTexture& texture : texturesOf(material))
                if (*texture.ref) {
                    const auto used = static_cast<std::size_t>(texture.ref->image);
                    checkColors(used, texture.srgb);
                    texture.ref->image = place[used];
                }
    }

    /// Warns if an image declares a colour space other than that of its use in a material. The use
    /// takes precedence.
    void checkColors(std::size_t used, bool srgb) {
        const std::optional<bool> stored = decoded_[used].texture.srgb;
        if (stored && *stored != srgb)
            document_.warn("The image " + pointerOf(used) + " is marked as " +
                           (*stored ? "sRGB" : "linear") + ", but is read as " +
                           (srgb ? "sRGB" : "linear") + ", as its use in a material requires.");
    }

    std::string pointerOf(std::size_t used) const {
        return childPointer("/images", static_cast<std::size_t>(used_images_[used]));
    }

    static std::string shortUri(const std::string& uri) { return isDataUri(uri) ? "" : uri; }

    GltfDocument& document_;
    const GltfOptions& options_;
    Scene& scene_;
    /// Indices in document_.images of the used images, in order of first use.
    std::vector<int> used_images_;
    /// For each used image, the index in document_.images of its fallback; −1 without a fallback.
    std::vector<int> fallbacks_;
    std::vector<Decoded> decoded_;  ///< for each used image
    std::vector<int> places_;       ///< for each image of the document, its index in used_images_
};

}  // namespace

void readGltfMaterials(GltfDocument& document, const GltfOptions& options, Scene& scene) {
    MaterialReader(document, options, scene).read();
}

}  // namespace peeler
