// SPDX-License-Identifier: Apache-2.0
// Compositing of captured fragments on the CPU: the reference for every method.
#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <vector>

#include <peeler/layered_image.h>

#pragma GCC visibility push(default)

namespace peeler::inline v0 {

/// What becomes of fragments behind the layers that a limit keeps.
enum class Tail : std::uint8_t {
    kDrop,
    kBlend  ///< composites: blended behind them as a weighted average
};

/// A colour with coloured opacity: R, G, B, A, AR, AG, AB, premultiplied. Light of channel c that
/// comes from behind is multiplied by 1 − A_c. A is the mean of the three, for readers that expect
/// one opacity; compositing ignores it.
using TintedColor = std::array<float, kTintedComponents>;

/// An ordinary colour as one whose channels are all as opaque as it is.
inline TintedColor tinted(const std::array<float, 4>& c) {
    return {c[0], c[1], c[2], c[3], c[3], c[3], c[3]};
}
/// Without the opacities of single channels.
inline std::array<float, 4> untinted(const TintedColor& c) {
    return {c[0], c[1], c[2], c[3]};
}

/// A flattened band: premultiplied linear RGBA in 32-bit float, and the camera Z of each pixel's
/// first fragment (+inf in empty pixels). Row-major inside `window`.
struct CompositeImage {
    Window window;
    std::vector<std::array<float, 4>> rgba;
    std::vector<float> z;
    /// AR, AG, AB of every pixel where opacity is coloured; else empty, and A holds for all.
    std::vector<std::array<float, 3>> opacity{};
    std::vector<FragmentArray> extra{};  ///< other quantities, a record a pixel

    /// Bytes of a pixel's colour and Z.
    static constexpr std::size_t pixelBytes(bool is_tinted) {
        return (colorComponents(is_tinted) + 1) * sizeof(float);
    }

    bool tinted() const { return !opacity.empty(); }
    /// Whether two pixels have the same colour.
    bool isSame(std::size_t a, std::size_t b) const {
        return rgba[a] == rgba[b] && (!tinted() || opacity[a] == opacity[b]);
    }
    TintedColor colorAt(std::size_t pixel) const {
        if (!tinted()) return peeler::tinted(rgba[pixel]);
        const auto& [r, g, b, a] = rgba[pixel];
        return {r, g, b, a, opacity[pixel][0], opacity[pixel][1], opacity[pixel][2]};
    }
    /// Of opacity what the picture has.
    void setColor(std::size_t pixel, const TintedColor& color) {
        rgba[pixel] = untinted(color);
        if (tinted()) opacity[pixel] = {color[4], color[5], color[6]};
    }
    /// Of a picture whose opacity is not coloured.
    void setColor(std::size_t pixel, const std::array<float, 4>& color) { rgba[pixel] = color; }
    /// Room for the colours of the window.
    void resizeColors(bool is_tinted) {
        rgba.resize(window.pixels());
        opacity.resize(is_tinted ? window.pixels() : 0);
    }
    /// Adds the colours of the pixels [first, last) of another picture.
    void appendColors(const CompositeImage& from, std::size_t first, std::size_t last) {
        rgba.insert(rgba.end(), from.rgba.data() + first, from.rgba.data() + last);
        if (from.tinted())
            opacity.insert(opacity.end(), from.opacity.data() + first, from.opacity.data() + last);
    }
    void appendColors(const CompositeImage& from) { appendColors(from, 0, from.rgba.size()); }
    /// Adds colours and Z of the rows [y0, y1) of another picture; the window stays as it is.
    void appendRows(const CompositeImage& from, int y0, int y1);
    /// Colours, Z and window become those of these rows of another picture.
    void setRows(const CompositeImage& from, int y0, int y1);
    /// Removes colours and Z.
    void clear();
};

/// Front to back "over" of premultiplied colours (Porter & Duff 1984): C += (1 − A)·c, A += (1 −
/// A)·a, in 32-bit float, in list order; with coloured opacity in every channel by its own. The
/// order of operations is the same, so where a pixel's opacities are all equal it has the same
/// bits. `background` (premultiplied) goes last; all zero adds nothing. `out` is overwritten; its
/// storage is reused.
void compositeOver(const LayeredImage& image, const std::array<float, 4>& background,
                   CompositeImage& out);

/// a in front of b, premultiplied: a + (1 − a.a)·b.
std::array<float, 4> over(const std::array<float, 4>& a, const std::array<float, 4>& b);
/// The same in every channel by a's opacity there.
TintedColor over(const TintedColor& a, const TintedColor& b);

/// The colour of one fragment, without the opacities of single channels.
std::array<float, 4> colorOf(const LayeredImage& image, std::size_t fragment);
/// The same with them; all are A where the image has none.
TintedColor tintedColorOf(const LayeredImage& image, std::size_t fragment);
}  // namespace peeler::inline v0

#pragma GCC visibility pop
