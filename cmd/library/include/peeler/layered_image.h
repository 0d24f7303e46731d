// SPDX-License-Identifier: Apache-2.0
// The one hand-over type: depth-sorted fragment lists of a rectangle of pixels.
#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <span>
#include <string>
#include <string_view>
#include <vector>

#include <peeler/window.h>

#pragma GCC visibility push(default)

namespace peeler::inline v0 {

/// How one component of a fragment is stored.
enum class PixelType : std::uint8_t { kHalf, kFloat, kUint };

inline constexpr std::size_t pixelTypeSize(PixelType type) {
    return type == PixelType::kHalf ? 2 : 4;
}

/// A named quantity of every fragment: `components` values of `type`, interleaved, fragment after
/// fragment. `channels` holds the EXR channel name of each component ("R","G","B","A" or "N.X", …).
struct FragmentArray {
    std::vector<std::string> channels;
    PixelType type = PixelType::kHalf;
    std::vector<std::byte> data;

    std::size_t components() const { return channels.size(); }
    std::size_t stride() const { return components() * pixelTypeSize(type); }
    template <class T>
    std::span<const T> as() const {
        return {reinterpret_cast<const T*>(data.data()), data.size() / sizeof(T)};
    }
    template <class T>
    std::span<T> as() {
        return {reinterpret_cast<T*>(data.data()), data.size() / sizeof(T)};
    }
};

/// What a colour consists of, as channels are called in files: premultiplied colour, its opacity,
/// and, where glass may filter colour by colour, the opacity in each of them (OpenEXR's names; A is
/// their mean then).
inline constexpr std::array kColorNames = {"R", "G", "B", "A", "AR", "AG", "AB"};
inline constexpr std::size_t kPlainComponents = 4, kTintedComponents = 7;

/// How many of these a colour has: `tinted`, with the opacity of each channel.
inline constexpr std::size_t colorComponents(bool tinted) {
    return tinted ? kTintedComponents : kPlainComponents;
}

/// The channels of a colour.
inline std::vector<std::string> colorNames(bool tinted) {
    return {kColorNames.begin(), kColorNames.begin() + colorComponents(tinted)};
}

/// No index of a fragment: where a pixel has none.
inline constexpr std::uint32_t kNoFragment = 0xFFFFFFFFU;

/// Per-pixel fragment lists in CSR form: pixel p (row-major inside `window`) owns the fragments
/// [offsets[p], offsets[p + 1]), front to back, coincident ones in draw order. It is at once a deep
/// image, a layered depth image (layer k is the k-th entry of every pixel that has one) and a set
/// of ray hits. A band of rows is a LayeredImage too.
struct LayeredImage {
    Window window;
    std::vector<std::uint32_t> offsets;  ///< window.pixels() + 1 entries, offsets[0] = 0
    std::vector<float> z;                ///< camera Z, positive in front, scene units
    /// R,G,B,A, or with coloured opacity R,G,B,A,AR,AG,AB (colorNames); linear Rec. 709,
    /// premultiplied; half or float. Of hits nothing, or dDepth.X and dDepth.Y (float): by how much
    /// buffer depth grows to the next pixel's ray, y up.
    FragmentArray color;
    std::vector<FragmentArray> extra;  ///< the other channels that were asked for

    std::size_t fragments() const { return z.size(); }
    /// Whether opacity is coloured: AR, AG, AB are there beside A.
    bool tinted() const { return color.components() == kTintedComponents; }
    std::size_t pixelIndex(int x, int y) const {
        return static_cast<std::size_t>(y - window.y0) * static_cast<std::size_t>(window.width()) +
               static_cast<std::size_t>(x - window.x0);
    }
    std::uint32_t count(std::size_t pixel) const { return offsets[pixel + 1] - offsets[pixel]; }
};

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

}  // namespace peeler::inline v0

#pragma GCC visibility pop
