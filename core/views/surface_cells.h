// SPDX-License-Identifier: Apache-2.0
// Fragments as pieces of surface that fit together.
#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <vector>

#include "core/image/layered_image.h"
#include "core/scene/view.h"
#include "core/views/surface_links.h"

namespace peeler {

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
    /// Planar depth (PixelRays) of each corner: the mean of what the fragments that share it
    /// expect there, going by their own slopes. 0 of fragments that no camera can see.
    std::vector<std::array<float, kCorners>> corners;
};

SurfaceCells surfaceCells(const LayeredImage& image, const View& view);

}  // namespace peeler
