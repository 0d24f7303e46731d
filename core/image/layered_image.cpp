// SPDX-License-Identifier: Apache-2.0
#include <peeler/layered_image.h>

#define IMATH_HALF_NO_LOOKUP_TABLE
#include <Imath/half.h>
#include <cstdint>
#include <cstring>

namespace peeler::inline v0 {
namespace {

template <class T>
T read(const std::byte* data) {
    T number;
    std::memcpy(&number, data, sizeof number);
    return number;
}

}  // namespace

const std::byte* FragmentChannel::data(std::size_t fragment) const {
    return array_->data.data() + fragment * array_->stride() +
           component_ * pixelTypeSize(array_->type);
}

std::uint32_t FragmentChannel::id(std::size_t fragment) const {
    return read<std::uint32_t>(data(fragment));
}

float FragmentChannel::value(std::size_t fragment) const {
    const std::byte* bytes = data(fragment);
    if (type() == PixelType::kHalf) return imath_half_to_float(read<std::uint16_t>(bytes));
    if (type() == PixelType::kFloat) return read<float>(bytes);
    return static_cast<float>(read<std::uint32_t>(bytes));
}

FragmentChannel findChannel(const LayeredImage& image, std::string_view name) {
    for (const FragmentArray& array : image.extra) {
        for (std::size_t c = 0; c < array.components(); ++c) {
            if (array.channels[c] == name) return {array, c};
        }
    }
    return {};
}

FragmentChannel findIds(const LayeredImage& image, std::string_view name) {
    const FragmentChannel channel = findChannel(image, name);
    return channel && channel.type() == PixelType::kUint ? channel : FragmentChannel();
}

}  // namespace peeler::inline v0
