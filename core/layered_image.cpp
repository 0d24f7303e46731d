// SPDX-License-Identifier: Apache-2.0
#include "core/layered_image.h"

#include <algorithm>
#include <cstring>

namespace peeler {

void keepNearest(LayeredImage& image, std::uint32_t limit) {
    image.extra.clear();
    const std::size_t stride = image.color.stride();
    std::uint32_t kept = 0;
    for (std::size_t pixel = 0; pixel + 1 < image.offsets.size(); ++pixel) {
        const std::uint32_t first = image.offsets[pixel];
        const std::uint32_t count = std::min(image.count(pixel), limit);
        std::copy_n(image.z.begin() + first, count, image.z.begin() + kept);
        std::memmove(image.color.data.data() + kept * stride,
                     image.color.data.data() + first * stride, count * stride);
        // The list that starts here has been read; the next one's start has not.
        image.offsets[pixel] = kept;
        kept += count;
    }
    image.offsets.back() = kept;
    image.z.resize(kept);
    image.color.data.resize(kept * stride);
}

}  // namespace peeler
