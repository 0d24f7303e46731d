// SPDX-License-Identifier: Apache-2.0
// Textures of PLY and MTL files.
#include <algorithm>

#include <peeler/error.h>
#include "formats/gltf/gltf_decoders.h"
#include "formats/meshes/mesh_parts.h"

namespace peeler {
namespace {

constexpr int kClampToEdge = 33071;

/// Returns a channel of the pixel of `image` that is nearest to the centre of pixel (x, y) in a
/// picture of this size.
std::uint8_t nearest(const Image& image, int x, int y, int width, int height, int channel) {
    const auto scaled = [](int at, int from, int to) {
        return static_cast<std::size_t>((2 * std::int64_t{at} + 1) * to / (2 * std::int64_t{from}));
    };
    const std::size_t pixel =
        scaled(y, height, image.height) * static_cast<std::size_t>(image.width) +
        scaled(x, width, image.width);
    return image.rgba[4 * pixel + static_cast<std::size_t>(channel)];
}

}  // namespace

int MeshTextures::image(const MeshMap& map) {
    const auto [known, is_new] = images_.emplace(map.from + '/' + map.file, -1);
    if (!is_new) return known->second;
    const SceneReadOptions& options = file_.options();
    try {
        const std::vector<std::uint8_t> bytes = file_.readBeside(map.file, map.from, map.where);
        const auto allow = [&](std::uint64_t more) { file_.allow(more); };
        DecodedTexture decoded = decodeTexture(
            bytes, map.file, {options.max_image_dimension, options.max_image_bytes, allow});
        for (const std::string& note : decoded.notes)
            file_.warn("The image \"" + map.file + "\": " + note + ".");
        file_.scene().images.push_back(std::move(decoded.image));
        known->second = static_cast<int>(file_.scene().images.size()) - 1;
    } catch (const Error& problem) {
        file_.missing("The texture \"" + map.file + "\" is left out", problem, map.where);
    }
    return known->second;
}

TextureRef MeshTextures::texture(const MeshMap& map) {
    TextureRef texture;
    if (map) texture.image = image(map);
    if (map.clamp) texture.sampler.wrap_s = texture.sampler.wrap_t = kClampToEdge;
    // glTF's V is 1 − the file's V.
    texture.transform[0][0] = map.scale.x;
    texture.transform[1][1] = map.scale.y;
    texture.transform[2][0] = map.offset.x;
    texture.transform[2][1] = 1 - map.scale.y - map.offset.y;
    return texture;
}

TextureRef MeshTextures::combined(const std::array<Source, 4>& of) {
    TextureRef whole;
    std::array<int, 4> sources{};
    std::string name;
    int width = 0, height = 0;
    for (std::size_t i = 0; i < 4; ++i) {
        sources[i] = of[i].map && *of[i].map ? image(*of[i].map) : -1;
        if (sources[i] < 0) continue;
        const Image& source = file_.scene().images[static_cast<std::size_t>(sources[i])];
        width = std::max(width, source.width);
        height = std::max(height, source.height);
        if (!whole) whole = texture(*of[i].map);
        if (!name.ends_with(of[i].map->file)) name += (name.empty() ? "" : " + ") + of[i].map->file;
    }
    if (!whole) return whole;
    const auto [known, is_new] =
        images_.emplace(name + " " + std::to_string(of[0].channel) + std::to_string(of[1].channel) +
                            std::to_string(of[2].channel) + std::to_string(of[3].channel),
                        static_cast<int>(file_.scene().images.size()));
    whole.image = known->second;
    if (!is_new) return whole;
    Image image;
    image.name = name;
    image.width = width;
    image.height = height;
    file_.allow(std::uint64_t{4} * static_cast<std::uint64_t>(width) *
                static_cast<std::uint64_t>(height));
    image.rgba.reserve(std::size_t{4} * static_cast<std::size_t>(width) *
                       static_cast<std::size_t>(height));
    const std::vector<Image>& images = file_.scene().images;
    for (int y = 0; y < height; ++y)
        for (int x = 0; x < width; ++x)
            for (std::size_t i = 0; i < 4; ++i)
                image.rgba.push_back(sources[i] < 0
                                         ? std::uint8_t{255}
                                         : nearest(images[static_cast<std::size_t>(sources[i])], x,
                                                   y, width, height, of[i].channel));
    file_.scene().images.push_back(std::move(image));
    return whole;
}

}  // namespace peeler
