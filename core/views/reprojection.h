// SPDX-License-Identifier: Apache-2.0
// Reprojection of layers into another camera.
#pragma once

#include <functional>

#include <peeler/layered_image.h>
#include <peeler/view.h>

namespace peeler {

/// Renders one camera's layers from another camera, as layered depth images do (Shade, Gortler, He
/// & Szeliski, "Layered Depth Images", SIGGRAPH 1998), but with cells (SurfaceCells) instead of
/// splats. Cells are rasterised at pixel centres with exact arithmetic: neighbouring cells of a
/// surface leave no cracks, a transparent surface is blended once per pixel, and edges do not grow.
/// Within a cell, colour is interpolated bilinearly among the linked fragments around it. At the
/// captured camera, every pixel gets its own fragments and colours back.
///
/// `image` holds the fragments of a window of `from`. `take` gets the fragments of `to.crop` band
/// by band, top to bottom: R, G, B, A in 32-bit float and Z of `to`, without other channels;
/// fragments behind an opaque one are left out. A band is passed as to Sink::write(). Fragments
/// nearer than `to`'s near plane or beyond its far plane are not seen. The result does not depend
/// on the number of threads. Memory: about 50 bytes per fragment besides `image`, plus a band.
/// Throws Error (kMemory) if a band has over 2^32 fragments.
void reproject(const LayeredImage& image, const View& from, const View& to,
               const std::function<void(LayeredImage&& band)>& take);

}  // namespace peeler
