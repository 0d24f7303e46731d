// SPDX-License-Identifier: Apache-2.0
// Depth-sorted fragment lists for a window: the data type that all stages share.
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

/// The storage type of a fragment component.
enum class PixelType : std::uint8_t { kHalf, kFloat, kUint };

inline constexpr std::size_t pixelTypeSize(PixelType type) {
    return type == PixelType::kHalf ? 2 : 4;
}

/// A named quantity of all fragments: `components` values of `type` per fragment, interleaved.
/// `channels` holds the EXR channel name of each component ("R","G","B","A" or "N.X", …).
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

/// The channel names of a colour in OpenEXR: premultiplied colour, alpha and, for coloured opacity,
/// the alpha of each colour channel. With coloured opacity, A is the mean of AR, AG and AB.
inline constexpr std::array kColorNames = {"R", "G", "B", "A", "AR", "AG", "AB"};
inline constexpr std::size_t kPlainComponents = 4, kTintedComponents = 7;

inline constexpr std::size_t colorComponents(bool tinted) {
    return tinted ? kTintedComponents : kPlainComponents;
}

inline std::vector<std::string> colorNames(bool tinted) {
    return {kColorNames.begin(), kColorNames.begin() + colorComponents(tinted)};
}

inline constexpr std::uint32_t kNoFragment = 0xFFFFFFFFU;

/// Per-pixel fragment lists in CSR form: pixel p (row-major inside `window`) owns the fragments
/// [offsets[p], offsets[p + 1]), front to back; coincident fragments are in draw order. Represents
/// a deep image, a layered depth image (layer k holds the k-th fragment of every pixel), a set of
/// ray hits, or a band of rows.
struct LayeredImage {
    Window window;
    std::vector<std::uint32_t> offsets;  ///< window.pixels() + 1 entries, offsets[0] = 0
    std::vector<float> z;                ///< camera Z, positive in front, scene units
    /// R,G,B,A or, with coloured opacity, R,G,B,A,AR,AG,AB (colorNames); linear Rec. 709,
    /// premultiplied; half or float. Empty for ray hits, except among Gaussian splats (surfaces are
    /// 0), and with HitMode::kSloped: then the components are dDepth.X and dDepth.Y (float), the
    /// change in buffer depth from one pixel's ray to the next, y up.
    FragmentArray color;
    std::vector<FragmentArray> extra;  ///< one array per channel other than colour and Z

    std::size_t fragments() const { return z.size(); }
    bool tinted() const { return color.components() == kTintedComponents; }
    std::size_t pixelIndex(int x, int y) const {
        return static_cast<std::size_t>(y - window.y0) * static_cast<std::size_t>(window.width()) +
               static_cast<std::size_t>(x - window.x0);
    }
    std::uint32_t count(std::size_t pixel) const { return offsets[pixel + 1] - offsets[pixel]; }
};

/// A view of one component of `LayeredImage::extra`. The image must outlive the view.
class FragmentChannel {
  public:
    FragmentChannel() = default;
    FragmentChannel(const FragmentArray& array, std::size_t component)
        : array_(&array), component_(component) {}

    explicit operator bool() const { return array_ != nullptr; }
    PixelType type() const { return array_->type; }
    const std::byte* data(std::size_t fragment) const;
    /// Returns the value of a fragment in a channel of type uint.
    std::uint32_t id(std::size_t fragment) const;
    /// Returns the value of a fragment; uint values are rounded to float.
    float value(std::size_t fragment) const;

  private:
    const FragmentArray* array_ = nullptr;
    std::size_t component_ = 0;
};

/// Returns the channel, or an empty FragmentChannel if the image lacks it.
FragmentChannel findChannel(const LayeredImage& image, std::string_view name);
/// Returns the channel if it exists and its type is uint, else an empty FragmentChannel.
FragmentChannel findIds(const LayeredImage& image, std::string_view name);

}  // namespace peeler::inline v0

#pragma GCC visibility pop
