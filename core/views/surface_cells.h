// SPDX-License-Identifier: Apache-2.0
// Fragments as pieces of surface that fit together: which of neighbouring pixels are one surface,
// and what each covers.
#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <vector>

#include <peeler/layered_image.h>
#include <peeler/view.h>

namespace peeler {

/// Clockwise: the side after next is the opposite one.
enum Side : std::uint8_t { kLeft, kUp, kRight, kDown };
inline constexpr std::size_t kSides = 4;

/// Of every fragment the one that continues its surface in the pixel on each side, or kNoFragment.
/// What it links to links back.
using SurfaceLinks = std::vector<std::array<std::uint32_t, kSides>>;

/// Layers are ordered by depth and not by surface, so a fragment's neighbour may be on any layer.
/// Fragments of two pixels are paired by the least step in depth, nearest pairs first; equal ones
/// (surfaces that coincide) in draw order. With channels `id.object` and `id.instance` only
/// fragments of the same object are paired. A step remains if it is gentle (below a slope of 72°),
/// or if the surface goes on with a similar step on one side of it; otherwise it is taken for the
/// edge of what is in front.
SurfaceLinks linkSurfaces(const LayeredImage& image, const View& view);

/// Corners of a pixel, clockwise; corner c lies between the sides c and c + 1.
enum Corner : std::uint8_t { kUpperLeft, kUpperRight, kLowerRight, kLowerLeft };
inline constexpr std::size_t kCorners = 4;

/// Where a corner is, in pixels from the sample.
inline constexpr std::array<std::array<double, 2>, kCorners> kCornerOffsets = {
    {{-0.5, -0.5}, {0.5, -0.5}, {0.5, 0.5}, {-0.5, 0.5}}};

/// Every fragment's pixel laid onto its surface: a cell of four corners. Neighbours of one surface
/// share corners to the bit, so cells leave no gaps and do not overlap; where the surface ends, a
/// cell ends half a pixel beyond its sample, as the pixel did.
struct SurfaceCells {
    SurfaceLinks links;
    /// Planar depth (PixelRays) of each corner: the mean of what the fragments that share it expect
    /// there, going by their own slopes. 0 of fragments that no camera can see.
    std::vector<std::array<float, kCorners>> corners;
};

/// The cells of all fragments of `image`, which is a window of the view.
SurfaceCells surfaceCells(const LayeredImage& image, const View& view);

}  // namespace peeler
