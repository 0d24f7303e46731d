// SPDX-License-Identifier: Apache-2.0
// A pixel is handed over as a list of one fragment: "over" of a single fragment is itself.
#include "formats/image/picture_file.h"

#include <algorithm>
#include <cstring>
#include <numeric>

namespace peeler {

void writePicture(const std::string& path, const CompositeImage& picture,
                  const OutputOptions& options) {
    OutputOptions flat = options;
    flat.as = "composite";
    const auto sink = makeSink(path, flat);
    const auto width = static_cast<std::size_t>(picture.window.width());
    const int height = picture.window.height();
    Plan plan;
    plan.view.width = picture.window.width();
    plan.view.height = height;
    plan.view.crop = {0, 0, plan.view.width, height};
    plan.color_type = PixelType::kFloat;
    plan.layers = {{plan.view.crop, picture.window.pixels()}};
    plan.fragments_counted = plan.fragments_stored = picture.window.pixels();
    sink->begin(plan);
    constexpr int kRowsAtOnce = 256;
    for (int y = 0; y < height; y += kRowsAtOnce) {
        LayeredImage band;
        band.window = {0, y, plan.view.width, std::min(y + kRowsAtOnce, height)};
        const std::size_t pixels = band.window.pixels();
        band.color.channels = {"R", "G", "B", "A"};
        band.color.type = PixelType::kFloat;
        band.offsets.resize(pixels + 1);
        std::iota(band.offsets.begin(), band.offsets.end(), 0U);
        band.z.assign(pixels, 1);
        band.color.data.resize(pixels * band.color.stride());
        std::memcpy(band.color.data.data(),
                    picture.rgba.data() + static_cast<std::size_t>(y) * width,
                    band.color.data.size());
        sink->write(std::move(band));
    }
    sink->finish();
}

}  // namespace peeler
