// SPDX-License-Identifier: Apache-2.0
// Pictures generated from a seed: random fragment lists and their plan, cut into arbitrary bands.
#pragma once

#include <Imath/half.h>

#include <algorithm>
#include <cstring>
#include <fstream>
#include <iterator>
#include <random>
#include <string>
#include <vector>

#include <peeler/sink.h>

namespace peeler::test {

struct SyntheticOptions {
    std::uint32_t seed = 1;
    int width = 83, height = 61;
    Window crop = {};  ///< empty = the whole picture
    int most_layers = 7;
    PixelType color_type = PixelType::kHalf;
    bool extra = false;  ///< whether to add id (uint) and N.X, N.Y, N.Z (half)
};

struct SyntheticPicture {
    Plan plan;
    LayeredImage image;  ///< all fragments of the crop
};

template <class T>
void appendValue(std::vector<std::byte>& data, T value) {
    const auto* bytes = reinterpret_cast<const std::byte*>(&value);
    data.insert(data.end(), bytes, bytes + sizeof value);
}

inline void appendColor(FragmentArray& array, float value) {
    if (array.type == PixelType::kHalf) {
        appendValue(array.data, half(value).bits());
    } else {
        appendValue(array.data, value);
    }
}

/// Returns a picture with 0 to `most_layers` fragments per pixel. About a quarter of the blocks of
/// 9 × 7 pixels are empty. A third of the fragments repeat the depth of the previous fragment.
/// Deeper layers have smaller data windows.
inline SyntheticPicture makePicture(const SyntheticOptions& options) {
    SyntheticPicture picture;
    Plan& plan = picture.plan;
    plan.view.width = options.width;
    plan.view.height = options.height;
    plan.view.crop =
        options.crop.empty() ? Window{0, 0, options.width, options.height} : options.crop;
    plan.view.projection.half_height = 0.5;
    plan.view.projection.half_width = 0.5 * options.width / options.height;
    plan.color_type = options.color_type;

    LayeredImage& image = picture.image;
    image.window = plan.view.crop;
    image.offsets = {0};
    image.color = {{"R", "G", "B", "A"}, options.color_type, {}};
    if (options.extra) {
        image.extra = {{{"N.X", "N.Y", "N.Z"}, PixelType::kHalf, {}},
                       {{"id"}, PixelType::kUint, {}}};
    }
    std::mt19937 random(options.seed);
    std::uniform_real_distribution<float> unit(0, 1);
    const Window& crop = plan.view.crop;
    for (int y = crop.y0; y < crop.y1; ++y) {
        for (int x = crop.x0; x < crop.x1; ++x) {
            const int block = static_cast<int>((static_cast<unsigned>(x / 9) * 2654435761U ^
                                                static_cast<unsigned>(y / 7) * 40503U) >>
                                               7U);
            const int edge = std::min({x - crop.x0, crop.x1 - 1 - x, y - crop.y0, crop.y1 - 1 - y});
            int count =
                block % 4 == 0 ? 0 : static_cast<int>(random() % 3U) + std::min(edge / 3, 99);
            count = std::min(count, options.most_layers);
            float z = 0.5F + unit(random);
            for (int k = 0; k < count; ++k) {
                if (random() % 3U != 0) z += 0.1F + unit(random);
                image.z.push_back(z);
                const float alpha = random() % 5U == 0 ? 1.0F : unit(random);
                for (int c = 0; c < 3; ++c)
                    appendColor(image.color, alpha * 3 * unit(random));
                appendColor(image.color, alpha);
                if (options.extra) {
                    for (int c = 0; c < 3; ++c) {
                        appendValue(image.extra[0].data, half(2 * unit(random) - 1).bits());
                    }
                    appendValue(image.extra[1].data, static_cast<std::uint32_t>(random()));
                }
                const auto layer = static_cast<std::size_t>(k);
                if (plan.layers.size() == layer) plan.layers.emplace_back();
                LayerPlan& entry = plan.layers[layer];
                entry.data_window = unite(entry.data_window, {x, y, x + 1, y + 1});
                ++entry.pixels;
            }
            image.offsets.push_back(static_cast<std::uint32_t>(image.z.size()));
        }
    }
    plan.fragments_counted = plan.fragments_stored = image.fragments();
    return picture;
}

/// Returns the rows [y0, y1) as a separate image.
inline LayeredImage cutRows(const LayeredImage& image, int y0, int y1) {
    LayeredImage band;
    band.window = {image.window.x0, y0, image.window.x1, y1};
    const std::size_t first = image.pixelIndex(image.window.x0, y0);
    const std::size_t last = image.pixelIndex(image.window.x0, y1);
    const std::size_t begin = image.offsets[first], end = image.offsets[last];
    for (std::size_t p = first; p <= last; ++p) {
        band.offsets.push_back(image.offsets[p] - image.offsets[first]);
    }
    band.z.assign(image.z.data() + begin, image.z.data() + end);
    const auto cut = [&](const FragmentArray& array) {
        const std::byte* data = array.data.data();
        return FragmentArray{array.channels,
                             array.type,
                             {data + begin * array.stride(), data + end * array.stride()}};
    };
    band.color = cut(image.color);
    for (const FragmentArray& array : image.extra)
        band.extra.push_back(cut(array));
    return band;
}

/// Writes the picture to a sink in bands whose heights cycle through `heights`.
inline void writePicture(Sink& sink, const SyntheticPicture& picture,
                         const std::vector<int>& heights = {1 << 20}) {
    sink.begin(picture.plan);
    const Window& window = picture.image.window;
    std::size_t turn = 0;
    for (int y = window.y0; y < window.y1;) {
        const int end = std::min(window.y1, y + heights[turn++ % heights.size()]);
        sink.write(cutRows(picture.image, y, end));
        y = end;
    }
    sink.finish();
}

}  // namespace peeler::test
