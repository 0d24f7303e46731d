// SPDX-License-Identifier: Apache-2.0
#include "core/views/surface_cells.h"

#include <algorithm>
#include <cmath>
#include <limits>
#include <span>
#include <string_view>

#include <peeler/layered_image.h>
#include "core/base/parallel.h"
#include "core/views/cell_rays.h"

namespace peeler {
namespace {

/// Limits of depth steps between neighbouring pixels, in pixel spacings (the tangent of the angle
/// between surface and picture). A pair of fragments has a step of at most kSteepestStep. A step of
/// more than kGentleStep needs a similar step beside it.
constexpr double kSteepestStep = 20, kGentleStep = 3;
/// The maximum difference between a steep step and its neighbour on the same surface, as a fraction
/// of the step.
constexpr double kBend = 0.8;
/// The cost of an unpaired fragment, in squared steps. A pair saves the cost of two unpaired
/// fragments, so the step of a pair may be up to kSteepestStep.
constexpr double kGap = kSteepestStep * kSteepestStep / 2;
/// The maximum number of fragments per pixel that get links. Fragments behind them get none.
constexpr std::size_t kMostFragments = 128;

constexpr Side opposite(Side side) {
    return static_cast<Side>((side + 2) % kSides);
}

class Linker {
  public:
    Linker(const LayeredImage& image, const CellRays& rays) : image_(image), rays_(rays) {
        links_.resize(image.fragments());
        planar_.resize(image.fragments());
        for (const char* name : {"id.object", "id.instance"})
            if (const FragmentChannel ids = findIds(image, name)) ids_.push_back(ids);
    }

    SurfaceLinks run() {
        const auto width = static_cast<std::size_t>(image_.window.width());
        const auto height = static_cast<std::size_t>(image_.window.height());
        parallelFor(height, [&](std::size_t y) {
            const std::size_t begin = image_.offsets[y * width];
            const std::size_t end = image_.offsets[(y + 1) * width];
            for (std::size_t f = begin; f < end; ++f) {
                links_[f].fill(kNoFragment);
                planar_[f] = rays_.planar(image_.z[f]);
            }
        });
        // Rows can run in parallel. Each row writes the upper sides of the next row's fragments,
        // but not the upper sides of its own.
        parallelFor(height, [&](std::size_t y) {
            Table table;
            for (std::size_t x = 0; x < width; ++x) {
                const std::size_t pixel = y * width + x;
                if (x + 1 < width) align(pixel, pixel + 1, kRight, table);
                if (y + 1 < height) align(pixel, pixel + width, kDown, table);
            }
        });
        SurfaceLinks kept(links_.size());
        parallelFor(height, [&](std::size_t y) {
            for (std::size_t p = y * width; p < (y + 1) * width; ++p) {
                for (std::size_t f = image_.offsets[p]; f < image_.offsets[p + 1]; ++f) {
                    for (const Side side : {kLeft, kUp, kRight, kDown})
                        kept[f][side] = holds(f, p, side) ? links_[f][side] : kNoFragment;
                }
            }
        });
        return kept;
    }

  private:
    enum Choice : std::uint8_t { kPair, kSkipFrom, kSkipTo };
    struct Table {
        std::vector<double> cost;
        std::vector<Choice> choice;
    };
    struct List {
        std::size_t first, count;
    };

    List list(std::size_t pixel) const {
        return {image_.offsets[pixel], std::min<std::size_t>(image_.count(pixel), kMostFragments)};
    }

    /// Returns the pixel beside a pixel of the window.
    std::size_t beside(std::size_t pixel, Side side) const {
        const auto width = static_cast<std::size_t>(image_.window.width());
        const std::size_t step = side % 2 == 0 ? 1 : width;
        return side == kRight || side == kDown ? pixel + step : pixel - step;
    }

    /// Returns the signed depth step between two fragments, in pixel spacings. `pixel` is that of
    /// `from`.
    double slope(std::size_t from, std::size_t to, std::size_t pixel, Side side) const {
        // Both ends of a link take the spacing at the left or upper pixel.
        const std::size_t at = side == kRight || side == kDown ? pixel : beside(pixel, side);
        const auto width = static_cast<std::size_t>(image_.window.width());
        const double unit = rays_.unitStep(image_.window.x0 + static_cast<int>(at % width),
                                           image_.window.y0 + static_cast<int>(at / width),
                                           std::min(planar_[from], planar_[to]))[side % 2];
        return (planar_[to] - planar_[from]) / std::abs(unit);
    }

    double cost(std::size_t from, std::size_t to, std::size_t pixel, Side side) const {
        if (!rays_.isSeen(planar_[from]) || !rays_.isSeen(planar_[to]) || !sameObject(from, to))
            return std::numeric_limits<double>::infinity();
        const double step = slope(from, to, pixel, side);
        return step * step;
    }

    bool sameObject(std::size_t a, std::size_t b) const {
        return std::all_of(ids_.begin(), ids_.end(),
                           [&](const FragmentChannel& ids) { return ids.id(a) == ids.id(b); });
    }

    void link(std::uint32_t from, std::uint32_t to, Side side) {
        links_[from][side] = to;
        links_[to][opposite(side)] = from;
    }

    /// Finds the order-preserving assignment of two lists with the minimum sum of squared steps, by
    /// dynamic programming (sequence alignment). Squares matter if two parallel surfaces are closer
    /// to each other than their step: right and wrong pairings then have the same sum of plain
    /// steps. Greedy pairing would even prefer the wrong pairing.
    void align(std::size_t pixel, std::size_t next, Side side, Table& table) {
        const List from = list(pixel), to = list(next);
        if (from.count == 0 || to.count == 0) return;
        const std::size_t width = to.count + 1;
        table.cost.assign((from.count + 1) * width, 0);
        table.choice.assign((from.count + 1) * width, kSkipFrom);
        for (std::size_t j = 1; j <= to.count; ++j) {
            table.cost[j] = static_cast<double>(j) * kGap;
            table.choice[j] = kSkipTo;
        }
        for (std::size_t i = 1; i <= from.count; ++i) {
            table.cost[i * width] = static_cast<double>(i) * kGap;
            for (std::size_t j = 1; j <= to.count; ++j) {
                const std::size_t at = i * width + j;
                double best = table.cost[at - width] + kGap;
                const double other = table.cost[at - 1] + kGap;
                if (other < best) best = other, table.choice[at] = kSkipTo;
                const double paired = table.cost[at - width - 1] +
                                      cost(from.first + i - 1, to.first + j - 1, pixel, side);
                if (paired <= best) best = paired, table.choice[at] = kPair;
                table.cost[at] = best;
            }
        }
        for (std::size_t i = from.count, j = to.count; i > 0 || j > 0;) {
            const Choice choice = table.choice[i * width + j];
            if (choice == kPair)
                link(static_cast<std::uint32_t>(from.first + i - 1),
                     static_cast<std::uint32_t>(to.first + j - 1), side);
            i -= choice != kSkipTo;
            j -= choice != kSkipFrom;
        }
    }

    /// Whether to keep a link. The answer is the same for both ends of the link. `pixel` is that of
    /// the fragment.
    bool holds(std::size_t fragment, std::size_t pixel, Side side) const {
        const std::uint32_t next = links_[fragment][side];
        if (next == kNoFragment) return false;
        const double step = slope(fragment, next, pixel, side);
        if (std::abs(step) <= kGentleStep) return true;
        const std::uint32_t before = links_[fragment][opposite(side)];
        const std::uint32_t after = links_[next][side];
        const double most = kBend * std::abs(step);
        const auto bends = [&](std::size_t from, std::size_t to, std::size_t at) {
            return std::abs(step - slope(from, to, at, side)) > most;
        };
        return (before != kNoFragment && !bends(before, fragment, beside(pixel, opposite(side)))) ||
               (after != kNoFragment && !bends(next, after, beside(pixel, side)));
    }

    const LayeredImage& image_;
    const CellRays& rays_;
    SurfaceLinks links_;
    std::vector<double> planar_;
    std::vector<FragmentChannel> ids_;
};

}  // namespace

SurfaceLinks linkSurfaces(const LayeredImage& image, const View& view) {
    return Linker(image, CellRays(view, image.window)).run();
}

namespace {

/// The maximum factor between the planar depth at a corner and the planar depths of the fragments
/// around the corner, for perspective cameras. The limit keeps a surface that is seen edge-on from
/// extending behind the camera or to the horizon.
constexpr double kStretch = 2;

/// The sides that lead from pixel to pixel around a corner, clockwise. The first pixel is the one
/// whose `kLowerRight` is the corner.
constexpr std::array<Side, 4> kAround = {kRight, kDown, kLeft, kUp};
constexpr Side back(Side side) {
    return static_cast<Side>((side + 2) % kSides);
}

class CellMaker {
  public:
    CellMaker(const LayeredImage& image, const CellRays& rays, const SurfaceLinks& links)
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
        // The position of this pixel among the four pixels around the corner, in the order of
        // kAround.
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
    const CellRays& rays_;
    const SurfaceLinks& links_;
    std::vector<std::array<double, 2>> slopes_;  ///< change of planar depth per pixel (right, down)
};

}  // namespace

SurfaceCells surfaceCells(const LayeredImage& image, const CellRays& rays) {
    SurfaceCells cells;
    cells.links = Linker(image, rays).run();
    cells.corners.resize(image.fragments());
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

SurfaceCells surfaceCells(const LayeredImage& image, const View& view) {
    return surfaceCells(image, CellRays(view, image.window));
}

}  // namespace peeler
