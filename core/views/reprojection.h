// SPDX-License-Identifier: Apache-2.0
// Layers as another camera sees them.
#pragma once

#include <functional>

#include <peeler/layered_image.h>
#include <peeler/view.h>

namespace peeler {

/// Renders what one camera has captured as another one sees it: the use of layered depth images
/// (Shade, Gortler, He & Szeliski, "Layered Depth Images", SIGGRAPH 1998). Their splats are
/// replaced by cells, which are rasterised at pixel centres under exact arithmetic: neighbours on a
/// surface leave no cracks, a transparent surface is blended once wherever it is seen, and edges do
/// not grow. Within a cell the colour is interpolated bilinearly among the linked fragments around
/// it. Back at the captured camera every pixel gets its own fragments and colours again.
///
/// `image` holds the fragments of a window of `from`. `take` gets the fragments of `to.crop` band
/// by band, top to bottom: R, G, B, A in 32-bit float and Z of `to`, without other channels; what
/// lies behind an opaque fragment is left out. It is handed over like a band to Sink::write().
/// Fragments nearer than `to`'s near plane or beyond its far plane are not seen. The result does
/// not depend on the number of threads. Memory: about 50 bytes a fragment beside `image`, and a
/// band. Throws Error (kMemory) if a band has over 2^32 fragments.
void reproject(const LayeredImage& image, const View& from, const View& to,
               const std::function<void(LayeredImage&& band)>& take);

}  // namespace peeler
