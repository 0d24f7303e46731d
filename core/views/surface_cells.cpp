// SPDX-License-Identifier: Apache-2.0
#include "core/views/surface_cells.h"

#include <algorithm>

#include "core/base/parallel.h"
#include "core/scene/pixel_rays.h"

namespace peeler {
namespace {

/// Of a perspective camera a corner is no nearer or farther than its fragments by more than this
/// factor: a surface seen edge on must not reach behind the camera or to the horizon.
constexpr double kStretch = 2;

/// Around a corner, from the pixel whose corner `kLowerRight` it is, clockwise: the side by which
/// one gets to the next pixel.
constexpr std::array<Side, 4> kAround = {kRight, kDown, kLeft, kUp};
constexpr Side back(Side side) {
    return static_cast<Side>((side + 2) % kSides);
}

class CellMaker {
  public:
    CellMaker(const LayeredImage& image, const PixelRays& rays, const SurfaceLinks& links)
        : image_(image), rays_(rays), links_(links), slopes_(image.fragments()) {}

    void measure(std::size_t fragment) {
        const double here = rays_.planar(image_.z[fragment]);
        for (const Side axis : {kRight, kDown}) {
            const std::uint32_t after = links_[fragment][axis];
            const std::uint32_t before = links_[fragment][back(axis)];
            double sum = 0;
            int count = 0;
            if (after != kNoFragment) sum += rays_.planar(image_.z[after]) - here, ++count;
            if (before != kNoFragment) sum += here - rays_.planar(image_.z[before]), ++count;
            slopes_[fragment][axis == kDown] = count == 0 ? 0 : sum / count;
        }
    }

    float corner(std::uint32_t fragment, Corner corner) const {
        // Which of the four pixels around the corner this one is, as kAround counts them.
        const auto start = static_cast<std::size_t>((corner + 2) % kCorners);
        std::array<std::uint32_t, 4> members{};
        members.fill(kNoFragment);
        members[start] = fragment;
        std::size_t found = 1;
        std::uint32_t at = fragment;
        for (std::size_t i = start; found < 4; ++found, i = (i + 1) % 4) {
            at = links_[at][kAround[i]];
            if (at == kNoFragment) break;
            members[(i + 1) % 4] = at;
        }
        at = fragment;
        for (std::size_t i = start; found < 4; ++found, i = (i + 3) % 4) {
            at = links_[at][back(kAround[(i + 3) % 4])];
            if (at == kNoFragment) break;
            members[(i + 3) % 4] = at;
        }
        double sum = 0, least = 0, most = 0;
        int count = 0;
        for (std::size_t i = 0; i < 4; ++i) {
            if (members[i] == kNoFragment) continue;
            const double here = rays_.planar(image_.z[members[i]]);
            const auto& offset = kCornerOffsets[(i + 2) % 4];
            const auto& slope = slopes_[members[i]];
            sum += here + slope[0] * offset[0] + slope[1] * offset[1];
            least = count == 0 ? here : std::min(least, here);
            most = count == 0 ? here : std::max(most, here);
            ++count;
        }
        const double mean = sum / count;
        if (!rays_.perspective()) return static_cast<float>(mean);
        return static_cast<float>(std::clamp(mean, least / kStretch, most * kStretch));
    }

  private:
    const LayeredImage& image_;
    const PixelRays& rays_;
    const SurfaceLinks& links_;
    std::vector<std::array<double, 2>> slopes_;  ///< planar depth a pixel, right and down
};

}  // namespace

SurfaceCells surfaceCells(const LayeredImage& image, const View& view) {
    SurfaceCells cells;
    cells.links = linkSurfaces(image, view);
    cells.corners.resize(image.fragments());
    const PixelRays rays(view);
    CellMaker maker(image, rays, cells.links);
    const auto width = static_cast<std::size_t>(image.window.width());
    const auto forEach = [&](auto&& body) {
        parallelFor(static_cast<std::size_t>(image.window.height()), [&](std::size_t y) {
            for (std::uint32_t f = image.offsets[y * width]; f < image.offsets[(y + 1) * width];
                 ++f)
                body(f);
        });
    };
    forEach([&](std::uint32_t f) { maker.measure(f); });
    forEach([&](std::uint32_t f) {
        if (!rays.isSeen(rays.planar(image.z[f]))) return;
        for (const Corner corner : {kUpperLeft, kUpperRight, kLowerRight, kLowerLeft})
            cells.corners[f][corner] = maker.corner(f, corner);
    });
    return cells;
}

}  // namespace peeler
