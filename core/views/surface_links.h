// SPDX-License-Identifier: Apache-2.0
// Which fragments of neighbouring pixels are one surface.
#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <vector>

#include "core/image/layered_image.h"
#include "core/scene/view.h"

namespace peeler {

inline constexpr std::uint32_t kNoFragment = 0xFFFFFFFFU;

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

}  // namespace peeler
