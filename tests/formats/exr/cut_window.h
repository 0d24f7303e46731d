// SPDX-License-Identifier: Apache-2.0
// Tiles cut out of synthetic pictures.
#pragma once

#include "core/image/layers.h"
#include "formats/exr/synthetic_image.h"

namespace peeler::test {

/// Returns the pixels of a window of the image as a separate image.
inline LayeredImage cutWindow(const LayeredImage& image, const Window& window) {
    LayeredImage tile;
    tile.window = window;
    tile.offsets = {0};
    tile.color = {image.color.channels, image.color.type, {}};
    for (const FragmentArray& array : image.extra)
        tile.extra.push_back({array.channels, array.type, {}});
    const auto append = [](const FragmentArray& from, std::size_t begin, std::size_t end,
                           FragmentArray& to) {
        to.data.insert(to.data.end(), from.data.data() + begin * from.stride(),
                       from.data.data() + end * from.stride());
    };
    for (int y = window.y0; y < window.y1; ++y) {
        const std::size_t begin = image.offsets[image.pixelIndex(window.x0, y)];
        const std::size_t end = image.offsets[image.pixelIndex(window.x1 - 1, y) + 1];
        for (int x = window.x0; x < window.x1; ++x) {
            tile.offsets.push_back(tile.offsets.back() + image.count(image.pixelIndex(x, y)));
        }
        tile.z.insert(tile.z.end(), image.z.data() + begin, image.z.data() + end);
        append(image.color, begin, end, tile.color);
        for (std::size_t i = 0; i < tile.extra.size(); ++i)
            append(image.extra[i], begin, end, tile.extra[i]);
    }
    return tile;
}

/// Returns the tile with the plan of a render of only this window.
inline SyntheticPicture cutPicture(const SyntheticPicture& whole, const Window& window) {
    SyntheticPicture tile;
    tile.image = cutWindow(whole.image, window);
    tile.plan = whole.plan;
    tile.plan.view.crop = window;
    DepthComplexity complexity(window);
    complexity.addBand(tile.image);
    tile.plan.layers = complexity.layers();
    tile.plan.fragments_counted = tile.plan.fragments_stored = tile.image.fragments();
    return tile;
}

}  // namespace peeler::test
