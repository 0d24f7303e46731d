// SPDX-License-Identifier: Apache-2.0
// Fragment lists defined by functions, for tests without a renderer.
#pragma once

#include <array>
#include <functional>
#include <span>
#include <vector>

#include <peeler/layered_image.h>

namespace peeler::test {

struct TestFragment {
    float z = 0;
    std::array<float, 4> color{};
};

/// Returns an image of 32-bit floats. Pixel (x, y) has the fragments at(x, y).
inline LayeredImage fragmentLists(const Window& window,
                                  const std::function<std::vector<TestFragment>(int, int)>& at) {
    LayeredImage image;
    image.window = window;
    image.offsets.push_back(0);
    image.color.channels = {"R", "G", "B", "A"};
    image.color.type = PixelType::kFloat;
    for (int y = window.y0; y < window.y1; ++y) {
        for (int x = window.x0; x < window.x1; ++x) {
            for (const TestFragment& fragment : at(x, y)) {
                image.z.push_back(fragment.z);
                const auto bytes = std::as_bytes(std::span(fragment.color));
                image.color.data.insert(image.color.data.end(), bytes.begin(), bytes.end());
            }
            image.offsets.push_back(static_cast<std::uint32_t>(image.z.size()));
        }
    }
    return image;
}

}  // namespace peeler::test
