// SPDX-License-Identifier: Apache-2.0
#include <peeler/image_sink.h>

#include <limits>
#include <string>

#include <peeler/error.h>

namespace peeler::inline v0 {

void ImageSink::begin(const Plan& plan) {
    if (plan.fragments_stored > std::numeric_limits<std::uint32_t>::max())
        throw Error(ErrorKind::kMemory,
                    "a picture of " + std::to_string(plan.fragments_stored) +
                        " fragments is too large to keep in memory",
                    "", "capture a part of it, or use a sink that takes one band at a time");
    image = {};
    fragments_ = static_cast<std::size_t>(plan.fragments_stored);
    pixels_ = static_cast<std::size_t>(plan.view.crop.pixels());
}

SinkMemory ImageSink::memory(const Plan& plan) const {
    const std::uint64_t fragment_bytes =
        sizeof(float) + colorComponents(plan.tinted) * pixelTypeSize(plan.color_type) +
        plan.channel_bytes;
    return {.bytes = plan.fragments_stored * fragment_bytes +
                     plan.view.crop.pixels() * sizeof(std::uint32_t)};
}

void ImageSink::write(LayeredImage&& band) {
    if (image.offsets.empty()) {
        image = std::move(band);
        image.offsets.reserve(pixels_ + 1);
        image.z.reserve(fragments_);
        image.color.data.reserve(fragments_ * image.color.stride());
        for (FragmentArray& array : image.extra)
            array.data.reserve(fragments_ * array.stride());
        return;
    }
    image.window = unite(image.window, band.window);
    const std::uint32_t before = image.offsets.back();
    for (std::size_t p = 1; p < band.offsets.size(); ++p)
        image.offsets.push_back(before + band.offsets[p]);
    image.z.insert(image.z.end(), band.z.begin(), band.z.end());
    const auto append = [](FragmentArray& to, const FragmentArray& from) {
        if (to.channels != from.channels || to.type != from.type)
            throw Error(ErrorKind::kInternal, "the bands of a picture have different channels");
        to.data.insert(to.data.end(), from.data.begin(), from.data.end());
    };
    append(image.color, band.color);
    if (band.extra.size() != image.extra.size())
        throw Error(ErrorKind::kInternal, "the bands of a picture have different channels");
    for (std::size_t i = 0; i < band.extra.size(); ++i)
        append(image.extra[i], band.extra[i]);
}

}  // namespace peeler::inline v0
