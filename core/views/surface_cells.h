// SPDX-License-Identifier: Apache-2.0
// Surface cells of fragments: links between neighbouring pixels, and the area that each fragment
// covers.
#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <vector>

#include <peeler/layered_image.h>
#include <peeler/view.h>
#include "core/views/cell_rays.h"

namespace peeler {

/// The sides of a pixel, clockwise. Side (s + 2) % 4 is opposite to side s.
enum Side : std::uint8_t { kLeft, kUp, kRight, kDown };
inline constexpr std::size_t kSides = 4;

/// For each fragment and side: the fragment that continues the surface in the neighbouring pixel,
/// or kNoFragment. Links are mutual.
using SurfaceLinks = std::vector<std::array<std::uint32_t, kSides>>;

/// Links the fragments of neighbouring pixels. Layers are ordered by depth, not by surface, so a
/// fragment's neighbour may be on any layer. Fragments of two pixels are paired in depth order
/// (coincident ones in draw order), with the minimum sum of squared depth steps. With channels
/// `id.object` and `id.instance`, only fragments of the same object are paired. A pair is kept if
/// its step is gentle (below a slope of 72°), or if the surface continues with a similar step on
/// one side of it. Other steps are silhouette edges.
SurfaceLinks linkSurfaces(const LayeredImage& image, const View& view);

/// The corners of a pixel, clockwise. Corner c is between the sides c and c + 1.
enum Corner : std::uint8_t { kUpperLeft, kUpperRight, kLowerRight, kLowerLeft };
inline constexpr std::size_t kCorners = 4;

/// The offset of each corner from the pixel's sample, in pixels.
inline constexpr std::array<std::array<double, 2>, kCorners> kCornerOffsets = {
    {{-0.5, -0.5}, {0.5, -0.5}, {0.5, 0.5}, {-0.5, 0.5}}};

/// Surface cells. A cell is a fragment's pixel, projected onto the fragment's surface; it has four
/// corners. Neighbouring cells of a surface share bit-identical corners, so they neither leave gaps
/// nor overlap. Where a surface ends, its last cell ends half a pixel beyond the sample, like the
/// pixel.
struct SurfaceCells {
    SurfaceLinks links;
    /// Planar depth (CellRays) of the four corners of each cell. Each fragment around a corner is
    /// extrapolated to the corner by its own slope, and the results are averaged. The depth is 0
    /// for fragments that the camera cannot see.
    std::vector<std::array<float, kCorners>> corners;
};

/// Returns the cells of all fragments of `image`, which is a window of the view. `rays` are those
/// of the image's window.
SurfaceCells surfaceCells(const LayeredImage& image, const CellRays& rays);
SurfaceCells surfaceCells(const LayeredImage& image, const View& view);

}  // namespace peeler
