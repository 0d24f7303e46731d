// SPDX-License-Identifier: Apache-2.0
// Layers in the buffers of a borrowed GL context.
#pragma once

#include <cstddef>
#include <cstdint>

#include <peeler/capture_settings.h>
#include <peeler/layered_image.h>
#include <peeler/window.h>

#pragma GCC visibility push(default)

namespace peeler::inline v0 {

/// The layers of a band of rows in GL buffers. The buffers hold the arrays of the band's
/// LayeredImage: pixel p, row by row from the top of `window`, has the fragments [offsets[p],
/// offsets[p + 1]), front to back; coincident fragments are in draw order. A buffer may be larger
/// than its array, and never has size 0.
struct GlLayers {
    Window window;  ///< the band, as wide as the crop; empty after the last band
    std::uint32_t fragments = 0;
    std::uint32_t layers = 0;  ///< largest number of fragments in a pixel
    PixelType color_type = PixelType::kHalf;
    bool tinted = false;   ///< whether opacity is coloured (LayeredImage::tinted)
    unsigned counts = 0;   ///< one uint per pixel: number of fragments
    unsigned offsets = 0;  ///< one uint per pixel: index of the first fragment; then the total
    unsigned depths = 0;   ///< one float per fragment: camera Z, positive in front, scene units
    /// Halfs or floats per fragment, linear Rec. 709, premultiplied: R, G, B, A or, with coloured
    /// opacity, R, G, B, A, AR, AG, AB and one unused value. Without coloured opacity, the buffer
    /// can be read as texels of format GL_RGBA16F or GL_RGBA32F.
    unsigned colors = 0;

    /// Returns the bytes from one fragment's colour to the next.
    std::size_t colorStride() const { return storedComponents(tinted) * pixelTypeSize(color_type); }
};

}  // namespace peeler::inline v0

#pragma GCC visibility pop
