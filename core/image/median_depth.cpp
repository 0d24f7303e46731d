// SPDX-License-Identifier: Apache-2.0
#include "core/image/median_depth.h"

#include <algorithm>
#include <cstddef>
#include <vector>

namespace peeler {
namespace {

std::vector<float> firstDepths(const LayeredImage& image, const Window& window) {
    std::vector<float> depths;
    for (int y = window.y0; y < window.y1; ++y) {
        for (int x = window.x0; x < window.x1; ++x) {
            const std::size_t pixel = image.pixelIndex(x, y);
            if (image.count(pixel) > 0) depths.push_back(image.z[image.offsets[pixel]]);
        }
    }
    return depths;
}

}  // namespace

std::optional<double> medianDepth(const LayeredImage& image, const View& view) {
    const Window middle{view.width / 3, view.height / 3, view.width - view.width / 3,
                        view.height - view.height / 3};
    std::vector<float> depths = firstDepths(image, intersect(middle, image.window));
    if (depths.empty()) depths = firstDepths(image, image.window);
    if (depths.empty()) return {};
    const auto median = depths.begin() + static_cast<std::ptrdiff_t>(depths.size() / 2);
    std::nth_element(depths.begin(), median, depths.end());
    return *median;
}

}  // namespace peeler
