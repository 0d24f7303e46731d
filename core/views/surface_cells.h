// SPDX-License-Identifier: Apache-2.0
// Connected surface cells of fragments: links between neighbouring pixels, and the area that each
// fragment covers.
#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <vector>

#include <peeler/layered_image.h>
#include <peeler/view.h>

namespace peeler {

/// Sides of a pixel, clockwise, so that the opposite side is two further on.
enum Side : std::uint8_t { kLeft, kUp, kRight, kDown };
inline constexpr std::size_t kSides = 4;

/// Per fragment and side, the fragment that continues its surface in the neighbouring pixel, or
/// kNoFragment. Links are mutual.
using SurfaceLinks = std::vector<std::array<std::uint32_t, kSides>>;

/// Links the fragments of neighbouring pixels. Layers are ordered by depth and not by surface, so a
/// fragment's neighbour may be on any layer. Fragments of two pixels are paired in depth order, so
/// that the sum of their squared depth steps is the least; coincident ones in draw order. With
/// channels `id.object` and `id.instance`, only fragments of the same object are paired. A pair
/// remains if its step is gentle (below a slope of 72°), or if the surface continues with a similar
/// step on one side of it; otherwise the step counts as a silhouette edge.
SurfaceLinks linkSurfaces(const LayeredImage& image, const View& view);

/// Corners of a pixel, clockwise; corner c lies between the sides c and c + 1.
enum Corner : std::uint8_t { kUpperLeft, kUpperRight, kLowerRight, kLowerLeft };
inline constexpr std::size_t kCorners = 4;

/// Offset of a corner from the sample, in pixels.
inline constexpr std::array<std::array<double, 2>, kCorners> kCornerOffsets = {
    {{-0.5, -0.5}, {0.5, -0.5}, {0.5, 0.5}, {-0.5, 0.5}}};

/// The pixel of every fragment projected onto its surface: a cell with four corners. Neighbours on
/// a surface share bit-identical corners, so cells neither leave gaps nor overlap. Where the
/// surface ends, a cell ends half a pixel beyond its sample, as the pixel does.
struct SurfaceCells {
    SurfaceLinks links;
    /// Planar depth (PixelRays) of each corner: the mean of the extrapolations of the fragments
    /// that share it, by their own slopes. 0 for fragments that the camera cannot see.
    std::vector<std::array<float, kCorners>> corners;
};

/// Returns the cells of all fragments of `image`, which is a window of the view.
SurfaceCells surfaceCells(const LayeredImage& image, const View& view);

}  // namespace peeler
