// SPDX-License-Identifier: Apache-2.0
// One channel of the fragments of a band, by its name.
#pragma once

#include <cstddef>
#include <string>
#include <string_view>

#include "core/image/layered_image.h"

namespace peeler {

/// One component of one of `LayeredImage::extra`. Refers to the image, which must outlive it.
class FragmentChannel {
  public:
    FragmentChannel() = default;
    FragmentChannel(const FragmentArray& array, std::size_t component)
        : array_(&array), component_(component) {}

    explicit operator bool() const { return array_ != nullptr; }
    PixelType type() const { return array_->type; }
    /// The stored bytes of a fragment's value, pixelTypeSize(type()) of them.
    const std::byte* data(std::size_t fragment) const;
    /// The value of a channel of type uint.
    std::uint32_t id(std::size_t fragment) const;
    /// The value, uint rounded to float.
    float value(std::size_t fragment) const;

  private:
    const FragmentArray* array_ = nullptr;
    std::size_t component_ = 0;
};

/// False if the image has no such channel.
FragmentChannel findChannel(const LayeredImage& image, std::string_view name);
/// The same of a channel of type uint; false also if it is of another.
FragmentChannel findIds(const LayeredImage& image, std::string_view name);

}  // namespace peeler
