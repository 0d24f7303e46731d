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

/// The treatment of fragments beyond the layer limit.
enum class Tail : std::uint8_t {
    kDrop,
    /// Composites only: a weighted average of these fragments is blended behind the kept layers.
    kBlend
};

/// A colour with coloured opacity: R, G, B, A, AR, AG, AB, premultiplied. Light from behind is
/// multiplied by 1 − A_c in channel c. A is the mean of AR, AG and AB, for readers that expect a
/// single alpha; compositing ignores A.
using TintedColor = std::array<float, kTintedComponents>;

/// Returns a plain colour as a tinted colour: AR, AG and AB equal A.
inline TintedColor tinted(const std::array<float, 4>& c) {
    return {c[0], c[1], c[2], c[3], c[3], c[3], c[3]};
}
inline std::array<float, 4> untinted(const TintedColor& c) {
    return {c[0], c[1], c[2], c[3]};
}

/// A flattened band: premultiplied linear RGBA in 32-bit float, and the camera Z of each pixel's
/// first fragment (+inf if the pixel is empty). All arrays are row-major inside `window`.
struct CompositeImage {
    Window window;
    std::vector<std::array<float, 4>> rgba;
    std::vector<float> z;
    /// AR, AG and AB of each pixel. If empty, A applies to every channel.
    std::vector<std::array<float, 3>> opacity{};
    std::vector<FragmentArray> extra{};  ///< further channels, one record per pixel

    /// Returns the bytes per pixel of colour and Z.
    static constexpr std::size_t pixelBytes(bool is_tinted) {
        return (colorComponents(is_tinted) + 1) * sizeof(float);
    }

    bool tinted() const { return !opacity.empty(); }
    bool isSame(std::size_t a, std::size_t b) const {
        return rgba[a] == rgba[b] && (!tinted() || opacity[a] == opacity[b]);
    }
    TintedColor colorAt(std::size_t pixel) const {
        if (!tinted()) return peeler::tinted(rgba[pixel]);
        const auto& [r, g, b, a] = rgba[pixel];
        return {r, g, b, a, opacity[pixel][0], opacity[pixel][1], opacity[pixel][2]};
    }
    /// Sets the colour. Drops the channel opacities if the picture is not tinted.
    void setColor(std::size_t pixel, const TintedColor& color) {
        rgba[pixel] = untinted(color);
        if (tinted()) opacity[pixel] = {color[4], color[5], color[6]};
    }
    void setColor(std::size_t pixel, const std::array<float, 4>& color) { rgba[pixel] = color; }
    void resizeColors(bool is_tinted) {
        rgba.resize(window.pixels());
        opacity.resize(is_tinted ? window.pixels() : 0);
    }
    /// Appends the colours of the pixels [first, last) of another picture.
    void appendColors(const CompositeImage& from, std::size_t first, std::size_t last) {
        rgba.insert(rgba.end(), from.rgba.data() + first, from.rgba.data() + last);
        if (from.tinted())
            opacity.insert(opacity.end(), from.opacity.data() + first, from.opacity.data() + last);
    }
    void appendColors(const CompositeImage& from) { appendColors(from, 0, from.rgba.size()); }
    /// Appends colours and Z of the rows [y0, y1) of another picture. The window is unchanged.
    void appendRows(const CompositeImage& from, int y0, int y1);
    /// Replaces colours, Z and window with those of the rows [y0, y1) of another picture.
    void setRows(const CompositeImage& from, int y0, int y1);
    void clear();
};

/// Composites front to back with "over" on premultiplied colours (Porter & Duff 1984): C += (1 −
/// A)·c, A += (1 − A)·a, in 32-bit float, in list order. With coloured opacity, each channel has
/// its own alpha; if these are equal in a pixel, its bits are the same as without coloured opacity.
/// `background` (premultiplied) is composited last; zeros have no effect. Overwrites `out` and
/// reuses its storage.
void compositeOver(const LayeredImage& image, const std::array<float, 4>& background,
                   CompositeImage& out);

/// Returns a over b, premultiplied: a + (1 − a.a)·b.
std::array<float, 4> over(const std::array<float, 4>& a, const std::array<float, 4>& b);
/// Returns a over b, each colour channel with its own opacity.
TintedColor over(const TintedColor& a, const TintedColor& b);

std::array<float, 4> colorOf(const LayeredImage& image, std::size_t fragment);
/// Returns a fragment's colour with channel opacities. If the image is not tinted, AR, AG and AB
/// equal A.
TintedColor tintedColorOf(const LayeredImage& image, std::size_t fragment);
}  // namespace peeler::inline v0

#pragma GCC visibility pop
