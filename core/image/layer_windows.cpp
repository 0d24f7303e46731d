// SPDX-License-Identifier: Apache-2.0
#include "core/image/layer_windows.h"

#include <cstddef>

namespace peeler {

void LayerWindows::add(int x, int y, std::uint32_t count) {
    if (count == 0) return;
    if (count > last_.size()) last_.resize(count);
    LayerPlan& layer = last_[count - 1];
    layer.data_window = unite(layer.data_window, {x, y, x + 1, y + 1});
    ++layer.pixels;
    fragments_ += count;
}

void LayerWindows::add(const LayeredImage& band) {
    std::size_t pixel = 0;
    for (int y = band.window.y0; y < band.window.y1; ++y) {
        for (int x = band.window.x0; x < band.window.x1; ++x, ++pixel)
            add(x, y, band.count(pixel));
    }
}

std::vector<LayerPlan> LayerWindows::layers() const {
    std::vector<LayerPlan> layers = last_;
    for (std::size_t k = layers.size(); k-- > 1;) {
        layers[k - 1].data_window = unite(layers[k - 1].data_window, layers[k].data_window);
        layers[k - 1].pixels += layers[k].pixels;
    }
    return layers;
}

}  // namespace peeler
