// SPDX-License-Identifier: Apache-2.0
// Pairs first, then second thoughts about the steep ones.
#include "core/surface_links.h"

#include <algorithm>
#include <cmath>
#include <span>
#include <string_view>

#include "core/parallel.h"
#include "core/pixel_rays.h"

namespace peeler {
namespace {

/// Steps, in pixel spacings: the tangent of the angle between surface and picture.
constexpr double kSteepest = 20, kGentle = 1.75;
/// A steep step and its neighbour on the same surface differ by no more than this share of it.
constexpr double kBend = 0.6;
/// How far around its own place a fragment looks for a partner in the next pixel's list.
constexpr std::uint32_t kReach = 8;

constexpr Side opposite(Side side) {
    return static_cast<Side>((side + 2) % kSides);
}

class Linker {
  public:
    Linker(const LayeredImage& image, const View& view) : image_(image), rays_(view) {
        links_.resize(image.fragments());
        planar_.resize(image.fragments());
        for (const FragmentArray& array : image.extra) {
            if (array.type != PixelType::kUint) continue;
            for (std::size_t c = 0; c < array.components(); ++c) {
                const std::string_view name = array.channels[c];
                if (name == "id.object" || name == "id.instance")
                    ids_.push_back({array.as<std::uint32_t>(), array.components(), c});
            }
        }
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
        // A row writes its own fragments' sides and the upper side of those in the row below.
        parallelFor(height, [&](std::size_t y) {
            std::vector<Pair> pairs;
            for (std::size_t x = 0; x < width; ++x) {
                const std::size_t pixel = y * width + x;
                if (x + 1 < width) pairUp(pixel, pixel + 1, kRight, pairs);
                if (y + 1 < height) pairUp(pixel, pixel + width, kDown, pairs);
            }
        });
        SurfaceLinks kept(links_.size());
        parallelFor(height, [&](std::size_t y) {
            for (std::size_t f = image_.offsets[y * width]; f < image_.offsets[(y + 1) * width];
                 ++f) {
                for (const Side side : {kLeft, kUp, kRight, kDown})
                    kept[f][side] = holds(f, side) ? links_[f][side] : kNoFragment;
            }
        });
        return kept;
    }

  private:
    struct Pair {
        double step;
        std::uint32_t from, to;
    };
    struct Id {
        std::span<const std::uint32_t> values;
        std::size_t stride, component;
    };

    /// The step between two fragments in pixel spacings, signed.
    double slope(std::size_t from, std::size_t to, Side side) const {
        const double unit = rays_.unitStep(std::min(planar_[from], planar_[to]))[side % 2];
        return (planar_[to] - planar_[from]) / std::abs(unit);
    }

    bool sameObject(std::size_t a, std::size_t b) const {
        return std::all_of(ids_.begin(), ids_.end(), [&](const Id& id) {
            return id.values[a * id.stride + id.component] ==
                   id.values[b * id.stride + id.component];
        });
    }

    void link(std::uint32_t from, std::uint32_t to, Side side) {
        links_[from][side] = to;
        links_[to][opposite(side)] = from;
    }

    void pairUp(std::size_t pixel, std::size_t next, Side side, std::vector<Pair>& pairs) {
        const std::uint32_t begin = image_.offsets[pixel], end = image_.offsets[pixel + 1];
        const std::uint32_t next_begin = image_.offsets[next], next_end = image_.offsets[next + 1];
        pairs.clear();
        for (std::uint32_t from = begin; from < end; ++from) {
            if (!rays_.isSeen(planar_[from])) continue;
            const auto at = static_cast<std::uint32_t>(
                std::lower_bound(image_.z.begin() + next_begin, image_.z.begin() + next_end,
                                 image_.z[from]) -
                image_.z.begin());
            // Coincident fragments may be many: the partner is about as far down the list.
            const std::uint32_t center = std::max(at, std::min(next_begin + from - begin, at + 1));
            const std::uint32_t first = center - std::min(center - next_begin, kReach);
            const std::uint32_t last = std::min(next_end, center + kReach);
            for (std::uint32_t to = first; to < last; ++to) {
                if (!rays_.isSeen(planar_[to]) || !sameObject(from, to)) continue;
                const double step = std::abs(slope(from, to, side));
                if (step <= kSteepest) pairs.push_back({step, from, to});
            }
        }
        std::sort(pairs.begin(), pairs.end(), [](const Pair& a, const Pair& b) {
            if (a.step != b.step) return a.step < b.step;
            return a.from != b.from ? a.from < b.from : a.to < b.to;
        });
        for (const Pair& pair : pairs) {
            if (links_[pair.from][side] == kNoFragment &&
                links_[pair.to][opposite(side)] == kNoFragment)
                link(pair.from, pair.to, side);
        }
    }

    /// Whether a link is kept. Both ends come to the same answer.
    bool holds(std::size_t fragment, Side side) const {
        const std::uint32_t next = links_[fragment][side];
        if (next == kNoFragment) return false;
        const double step = slope(fragment, next, side);
        if (std::abs(step) <= kGentle) return true;
        const std::uint32_t before = links_[fragment][opposite(side)];
        const std::uint32_t after = links_[next][side];
        const double most = kBend * std::abs(step);
        return (before != kNoFragment && std::abs(step - slope(before, fragment, side)) <= most) ||
               (after != kNoFragment && std::abs(step - slope(next, after, side)) <= most);
    }

    const LayeredImage& image_;
    PixelRays rays_;
    SurfaceLinks links_;
    std::vector<double> planar_;
    std::vector<Id> ids_;
};

}  // namespace

SurfaceLinks linkSurfaces(const LayeredImage& image, const View& view) {
    return Linker(image, view).run();
}

}  // namespace peeler
