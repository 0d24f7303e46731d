// SPDX-License-Identifier: Apache-2.0
#include "core/image/nearest.h"

#include <algorithm>
#include <cstring>

namespace peeler {
namespace {

void moveFragments(FragmentArray& array, std::size_t from, std::size_t to, std::size_t count) {
    const std::size_t stride = array.stride();
    std::memmove(array.data.data() + to * stride, array.data.data() + from * stride,
                 count * stride);
}

}  // namespace

void keepNearest(LayeredImage& image, std::uint32_t limit) {
    std::uint32_t kept = 0;
    for (std::size_t pixel = 0; pixel + 1 < image.offsets.size(); ++pixel) {
        const std::uint32_t first = image.offsets[pixel];
        const std::uint32_t count = std::min(image.count(pixel), limit);
        if (first != kept) {
            std::copy_n(image.z.begin() + first, count, image.z.begin() + kept);
            moveFragments(image.color, first, kept, count);
            for (FragmentArray& array : image.extra)
                moveFragments(array, first, kept, count);
        }
        // The list that starts here has been read; the next one's start has not.
        image.offsets[pixel] = kept;
        kept += count;
    }
    image.offsets.back() = kept;
    image.z.resize(kept);
    image.color.data.resize(kept * image.color.stride());
    for (FragmentArray& array : image.extra)
        array.data.resize(kept * array.stride());
}

}  // namespace peeler
