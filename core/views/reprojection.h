// SPDX-License-Identifier: Apache-2.0
// Reprojection of layers into another camera.
#pragma once

#include <functional>

#include <peeler/layered_image.h>
#include <peeler/view.h>

namespace peeler {

/// Renders the layers of one camera from another camera, like layered depth images (Shade, Gortler,
/// He & Szeliski, "Layered Depth Images", SIGGRAPH 1998), but with cells (SurfaceCells) instead of
/// splats. Cells are rasterised at pixel centres with exact arithmetic. Neighbouring cells of a
/// surface leave no cracks, a transparent surface is blended once per pixel, and edges do not grow.
/// Within a cell, colour is interpolated bilinearly among the linked fragments around it. From the
/// original camera, every pixel gets its own fragments and colours back.
///
/// `from` may have a lens, but `to` has none. Pixels whose corners have no ray show nothing. Throws
/// Error (kUsage) like CellRays::CellRays().
///
/// `image` holds the fragments of a window of `from`. `take` receives the fragments of `to.crop`
/// band by band, top to bottom, and may move each band from its argument, as Sink::write() may. A
/// fragment has R, G, B, A in 32-bit float and Z of `to`, without other channels. Fragments behind
/// an opaque fragment, in front of the near plane of `to` or beyond its far plane are dropped. The
/// result does not depend on the number of threads. Memory: about 50 bytes per fragment besides
/// `image`, 24 per pixel of a lens, plus a band. Throws Error (kMemory) if a band has more than
/// 2^32 fragments.
void reproject(const LayeredImage& image, const View& from, const View& to,
               const std::function<void(LayeredImage&& band)>& take);

}  // namespace peeler
