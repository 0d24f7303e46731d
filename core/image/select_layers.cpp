// SPDX-License-Identifier: Apache-2.0
#include "core/image/select_layers.h"

#include <cstring>
#include <utility>

namespace peeler {
namespace {

void moveFragment(FragmentArray& array, std::size_t from, std::size_t to) {
    const std::size_t stride = array.stride();
    std::memmove(array.data.data() + to * stride, array.data.data() + from * stride, stride);
}

void pickFragments(const FragmentArray& from, const std::vector<std::uint32_t>& fragments,
                   FragmentArray& to) {
    const std::size_t stride = from.stride();
    to.channels = from.channels;
    to.type = from.type;
    to.data.resize(fragments.size() * stride);
    for (std::size_t i = 0; i < fragments.size(); ++i) {
        std::memcpy(to.data.data() + i * stride, from.data.data() + fragments[i] * stride, stride);
    }
}

}  // namespace

void keepLayers(LayeredImage& image, const LayerSelection& selection) {
    if (selection.all()) return;
    std::uint32_t kept = 0;
    for (std::size_t pixel = 0; pixel + 1 < image.offsets.size(); ++pixel) {
        const std::uint32_t first = image.offsets[pixel], count = image.count(pixel);
        // The list that starts here is about to be read; the next one's start is still needed.
        image.offsets[pixel] = kept;
        for (std::uint32_t k = 0; k < count; ++k) {
            if (!selection.holds(k)) continue;
            image.z[kept] = image.z[first + k];
            moveFragment(image.color, first + k, kept);
            for (FragmentArray& array : image.extra)
                moveFragment(array, first + k, kept);
            ++kept;
        }
    }
    image.offsets.back() = kept;
    image.z.resize(kept);
    image.color.data.resize(kept * image.color.stride());
    for (FragmentArray& array : image.extra)
        array.data.resize(kept * array.stride());
}

void singleLayer(const LayeredImage& image, std::uint32_t layer, LayeredImage& out) {
    const std::size_t pixels = image.window.pixels();
    std::vector<std::uint32_t> fragments;
    out.window = image.window;
    out.offsets.assign(pixels + 1, 0);
    for (std::size_t pixel = 0; pixel < pixels; ++pixel) {
        if (image.count(pixel) > layer) fragments.push_back(image.offsets[pixel] + layer);
        out.offsets[pixel + 1] = static_cast<std::uint32_t>(fragments.size());
    }
    out.z.resize(fragments.size());
    for (std::size_t i = 0; i < fragments.size(); ++i)
        out.z[i] = image.z[fragments[i]];
    pickFragments(image.color, fragments, out.color);
    out.extra.resize(image.extra.size());
    for (std::size_t i = 0; i < out.extra.size(); ++i)
        pickFragments(image.extra[i], fragments, out.extra[i]);
}

void addLayerIndices(LayeredImage& image) {
    FragmentArray indices{{"layer"}, PixelType::kUint, {}};
    indices.data.resize(image.fragments() * indices.stride());
    const auto values = indices.as<std::uint32_t>();
    for (std::size_t pixel = 0; pixel + 1 < image.offsets.size(); ++pixel) {
        for (std::uint32_t k = 0; k < image.count(pixel); ++k)
            values[image.offsets[pixel] + k] = k;
    }
    image.extra.push_back(std::move(indices));
}

}  // namespace peeler
