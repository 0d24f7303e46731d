// SPDX-License-Identifier: Apache-2.0
#include "core/splats/splat_layers.h"

#define IMATH_HALF_NO_LOOKUP_TABLE
#include <Imath/half.h>
#include <algorithm>
#include <array>
#include <bit>
#include <cmath>
#include <cstring>
#include <numeric>

#include "core/base/lanes.h"
#include "core/base/parallel.h"
#include "core/base/resize_anew.h"
#include "core/fragments/supersampling.h"
#include "core/image/channels.h"
#include "core/scene/view.h"

namespace peeler {
namespace {

constexpr int kTile = 16;
constexpr float kMostOpacity = 0.99F;

/// Returns e^x for x from −87 to 0, with the same bits on every machine: 2^k times a polynomial of
/// the rest (Cephes' coefficients). The relative error is below 2e-7.
FourFloats exponential(const FourFloats& x) {
    constexpr float kLog2E = 1.44269504F, kLn2High = 0.693359375F, kLn2Low = -2.12194440e-4F;
    const FourFloats scaled = x * kLog2E - 0.5F;
    const FourInts k =
        __builtin_convertvector(scaled, FourInts);  // rounds towards 0, x is negative
    const FourFloats whole = __builtin_convertvector(k, FourFloats);
    const FourFloats r = x - whole * kLn2High - whole * kLn2Low;
    FourFloats p = r * 1.9875691500e-4F + 1.3981999507e-3F;
    p = p * r + 8.3334519073e-3F;
    p = p * r + 4.1665795894e-2F;
    p = p * r + 1.6666665459e-1F;
    p = p * r + 5.0000001201e-1F;
    p = p * r * r + r + 1.0F;
    return p * reinterpret_cast<FourFloats>((k + 127) << 23);
}

/// Returns the rows or columns, within a range, whose samples lie in the interval middle ± half.
std::pair<int, int> covered(float middle, float half, float sample, int first, int end) {
    const float low = std::ceil(middle - half - sample), high = std::floor(middle + half - sample);
    if (!(low <= high)) return {first, first};
    return {static_cast<int>(std::max(low, static_cast<float>(first))),
            static_cast<int>(std::min(high, static_cast<float>(end - 1))) + 1};
}

/// Returns the camera Z at which the response of a splat is largest along a ray (x, y, 1).
float depthAlong(const SplatDepth& depth, float x, float y, float otherwise) {
    const auto& p = depth.precision;
    const float to = depth.along[0] * x + depth.along[1] * y + depth.along[2];
    const float square = (p[0] * x + 2 * (p[1] * y + p[2])) * x + (p[3] * y + 2 * p[4]) * y + p[5];
    const float z = to / square;
    return z > 0 && std::isfinite(z) ? z : otherwise;
}

/// Returns the depth at which the response is largest along a parallel ray at (x, y).
float depthAtPlace(const SplatDepth& depth, float x, float y) {
    const auto& p = depth.precision;
    return (depth.along[2] - p[2] * x - p[4] * y) / p[5];
}

/// Sorts each pixel's fragments by Z, then by key.
void sortPixels(LayeredImage& image) {
    struct Entry {
        float z;
        std::uint32_t key, from;
    };
    const std::span<std::uint32_t> keys = image.extra.front().as<std::uint32_t>();
    const std::size_t stride = image.color.stride();
    const auto width = static_cast<std::size_t>(image.window.width());
    parallelFor(static_cast<std::size_t>(image.window.height()), [&](std::size_t row) {
        std::vector<Entry> entries;
        std::vector<std::byte> colors;
        for (std::size_t pixel = row * width; pixel < (row + 1) * width; ++pixel) {
            const std::uint32_t first = image.offsets[pixel], count = image.count(pixel);
            entries.clear();
            for (std::uint32_t i = 0; i < count; ++i)
                entries.push_back({image.z[first + i], keys[first + i], i});
            const auto precedes = [](const Entry& a, const Entry& b) {
                return a.z < b.z || (a.z == b.z && a.key < b.key);
            };
            if (std::ranges::is_sorted(entries, precedes)) continue;
            std::ranges::sort(entries, precedes);
            std::byte* const to = image.color.data.data() + first * stride;
            colors.assign(to, to + count * stride);
            for (std::uint32_t i = 0; i < count; ++i) {
                image.z[first + i] = entries[i].z;
                keys[first + i] = entries[i].key;
                std::memcpy(to + i * stride, colors.data() + entries[i].from * stride, stride);
            }
        }
    });
}

}  // namespace

/// The tiles that a band touches, and the splats of each, nearest first.
struct SplatLayers::Tiles {
    Window band;
    int x0 = 0, y0 = 0;  ///< of the first tile, pixels
    int across = 0, down = 0;
    std::vector<std::uint64_t> first;   ///< of each tile, in `splats`
    std::vector<std::uint32_t> splats;  ///< indices into SplatPicture::splats

    std::size_t size() const { return first.size() - 1; }
    Window window(std::size_t tile) const {
        const int x = x0 + static_cast<int>(tile) % across * kTile,
                  y = y0 + static_cast<int>(tile) / across * kTile;
        return intersect({x, y, x + kTile, y + kTile}, band);
    }
};

void SplatLayers::begin(const View& view, const CaptureSettings& settings) {
    const bool same = projected_ && view.camera_to_world == view_.camera_to_world &&
                      view.width == view_.width && view.height == view_.height &&
                      view.projection.perspective == view_.projection.perspective &&
                      view.projection.half_width == view_.projection.half_width &&
                      view.projection.half_height == view_.projection.half_height &&
                      view.projection.near == view_.projection.near &&
                      view.projection.far == view_.projection.far &&
                      settings.splat_order == settings_.splat_order &&
                      settings.splat_blending == settings_.splat_blending &&
                      settings.splat_dilation == settings_.splat_dilation;
    view_ = view;
    settings_ = settings;
    if (!same) picture_ = {};
    projected_ = same;
}

std::uint64_t SplatLayers::bytes() const {
    std::uint64_t splats = 0;
    for (const DrawnSurface& surface : posed_.drawList().surfaces()) {
        const MeshInstance& instance = posed_.meshes()[surface.instance];
        const Primitive& primitive = posed_.primitives(instance)[surface.primitive];
        if (primitive.splats) splats += primitive.splats->size();
    }
    constexpr std::uint64_t kTilesOfSplat = 8;
    return splats * (2 * (sizeof(ProjectedSplat) + sizeof(SplatDepth)) +
                     (2 + kTilesOfSplat) * sizeof(std::uint32_t));
}

SplatLayers::Tiles SplatLayers::tilesOf(const Window& band) {
    if (!std::exchange(projected_, true)) picture_ = projectSplats(posed_, view_, settings_);
    Tiles tiles;
    tiles.band = band;
    tiles.x0 = band.x0 / kTile * kTile;
    tiles.y0 = band.y0 / kTile * kTile;
    tiles.across = (band.x1 - tiles.x0 + kTile - 1) / kTile;
    tiles.down = (band.y1 - tiles.y0 + kTile - 1) / kTile;
    const auto count =
        static_cast<std::size_t>(tiles.across) * static_cast<std::size_t>(tiles.down);
    // A task lists the splats of one row of tiles, in their order.
    const auto sample = glm::vec2(view_.sample);
    tiles.first.assign(count + 1, 0);
    std::vector<std::vector<std::uint32_t>> lists(static_cast<std::size_t>(tiles.down));
    parallelFor(static_cast<std::size_t>(tiles.down), [&](std::size_t row) {
        const int y = tiles.y0 + static_cast<int>(row) * kTile;
        const int y0 = std::max(y, band.y0), y1 = std::min(y + kTile, band.y1);
        struct Entry {
            std::uint32_t splat;
            std::uint16_t begin, end;
        };
        std::vector<Entry> touched;
        std::vector<std::uint32_t> counts(static_cast<std::size_t>(tiles.across) + 1);
        for (std::size_t i = 0; i < picture_.splats.size(); ++i) {
            const ProjectedSplat& s = picture_.splats[i];
            const auto [from, to] = covered(s.y, s.half_height, sample.y, y0, y1);
            if (from >= to) continue;
            const auto [left, right] = covered(s.x, s.half_width, sample.x, band.x0, band.x1);
            if (left >= right) continue;
            const auto begin = static_cast<std::uint16_t>((left - tiles.x0) / kTile),
                       end = static_cast<std::uint16_t>((right - 1 - tiles.x0) / kTile + 1);
            touched.push_back({static_cast<std::uint32_t>(i), begin, end});
            for (std::size_t t = begin; t < end; ++t)
                ++counts[t + 1];
        }
        std::partial_sum(counts.begin(), counts.end(), counts.begin());
        lists[row].resize(counts.back());
        std::vector<std::uint32_t> next(counts.begin(), counts.end() - 1);
        for (const Entry& entry : touched)
            for (std::size_t t = entry.begin; t < entry.end; ++t)
                lists[row][next[t]++] = entry.splat;
        for (std::size_t t = 0; t < static_cast<std::size_t>(tiles.across); ++t)
            tiles.first[row * static_cast<std::size_t>(tiles.across) + t + 1] =
                counts[t + 1] - counts[t];
    });
    std::partial_sum(tiles.first.begin(), tiles.first.end(), tiles.first.begin());
    tiles.splats.reserve(tiles.first.back());
    for (std::vector<std::uint32_t>& list : lists) {
        tiles.splats.insert(tiles.splats.end(), list.begin(), list.end());
        list = {};
    }
    return tiles;
}

/// Calls visit(splat, x, y, exponents, inside) for groups of four pixels of a tile, from x to the
/// right, in which a splat has fragments. `inside`: a bit per pixel.
template <class Visit>
void SplatLayers::forEachFragment(const Tiles& tiles, std::size_t tile, Visit&& visit) const {
    const Window window = tiles.window(tile);
    const auto sample = glm::vec2(view_.sample);
    for (std::uint64_t n = tiles.first[tile]; n < tiles.first[tile + 1]; ++n) {
        const std::uint32_t index = tiles.splats[n];
        const ProjectedSplat& s = picture_.splats[index];
        const auto [top, bottom] = covered(s.y, s.half_height, sample.y, window.y0, window.y1);
        const auto [left, right] = covered(s.x, s.half_width, sample.x, window.x0, window.x1);
        for (int y = top; y < bottom; ++y) {
            const float dy = static_cast<float>(y) + sample.y - s.y;
            const float of_row = -0.5F * s.yy * dy * dy, slope = -s.xy * dy;
            for (int x = left; x < right; x += 4) {
                const auto at = static_cast<float>(x);
                const FourFloats dx = FourFloats{at, at + 1, at + 2, at + 3} + (sample.x - s.x);
                const FourFloats exponent = (dx * (-0.5F * s.xx) + slope) * dx + of_row;
                const FourInts kept = exponent >= s.least;
                unsigned inside = 0;
                for (int lane = 0; lane < 4; ++lane)
                    inside |= (static_cast<unsigned>(kept[lane]) & 1U) << lane;
                if (right - x < 4) inside &= (1U << (right - x)) - 1;
                if (inside != 0) visit(index, x, y, exponent, inside);
            }
        }
    }
}

void SplatLayers::addCounts(const Window& band, std::span<std::uint32_t> counts) {
    addCounts(tilesOf(band), counts);
}

void SplatLayers::addCounts(const Tiles& tiles, std::span<std::uint32_t> counts) const {
    const Window& band = tiles.band;
    const auto width = static_cast<std::size_t>(band.width());
    parallelFor(tiles.size(), [&](std::size_t tile) {
        forEachFragment(
            tiles, tile, [&](std::uint32_t, int x, int y, const FourFloats&, unsigned inside) {
                const std::size_t pixel = static_cast<std::size_t>(y - band.y0) * width +
                                          static_cast<std::size_t>(x - band.x0);
                for (unsigned left = inside; left != 0; left &= left - 1)
                    ++counts[pixel + static_cast<unsigned>(std::countr_zero(left))];
            });
    });
}

void SplatLayers::capture(const Window& band, LayeredImage& out) {
    const Tiles tiles = tilesOf(band);
    std::vector<std::uint32_t> next(band.pixels());
    addCounts(tiles, next);
    out.window = band;
    resizeAnew(out.offsets, band.pixels() + 1);
    out.offsets[0] = 0;
    std::partial_sum(next.begin(), next.end(), out.offsets.begin() + 1);
    std::copy(out.offsets.begin(), out.offsets.end() - 1, next.begin());
    const std::size_t fragments = out.offsets.back();
    resizeAnew(out.z, fragments);
    out.color.type = settings_.color_type;
    out.color.channels = colorNames(settings_.tinted);
    const std::size_t stride = out.color.stride();
    resizeAnew(out.color.data, fragments * stride);
    out.extra.resize(1);
    out.extra.front().channels = {kKeyChannel};
    out.extra.front().type = PixelType::kUint;
    resizeAnew(out.extra.front().data, fragments * sizeof(std::uint32_t));
    const std::span<std::uint32_t> keys = out.extra.front().as<std::uint32_t>();

    const bool by_ray = settings_.splat_order == SplatOrder::kRay;
    const bool half = settings_.color_type == PixelType::kHalf;
    const std::size_t components = out.color.components();
    const auto width = static_cast<std::size_t>(band.width());
    const PixelRays rays(view_);
    const auto depthOn = [&](const glm::vec2& at, const SplatDepth& depth, float otherwise) {
        return rays.perspective() ? depthAlong(depth, at.x, at.y, otherwise)
                                  : depthAtPlace(depth, at.x, at.y);
    };
    parallelFor(tiles.size(), [&](std::size_t tile) {
        forEachFragment(
            tiles, tile,
            [&](std::uint32_t index, int x, int y, const FourFloats& exponent, unsigned inside) {
                const ProjectedSplat& s = picture_.splats[index];
                const FourFloats response = exponential(exponent);
                for (unsigned left = inside; left != 0; left &= left - 1) {
                    const int lane = std::countr_zero(left);
                    const std::size_t pixel = static_cast<std::size_t>(y - band.y0) * width +
                                              static_cast<std::size_t>(x + lane - band.x0);
                    const std::uint32_t f = next[pixel]++;
                    const float alpha = std::min(kMostOpacity, s.opacity * response[lane]);
                    const std::array<float, 7> color{
                        s.red * alpha, s.green * alpha, s.blue * alpha, alpha, alpha, alpha, alpha};
                    std::byte* const to = out.color.data.data() + f * stride;
                    if (half) {
                        std::array<std::uint16_t, 7> rounded;
                        for (std::size_t c = 0; c < components; ++c)
                            rounded[c] = imath_float_to_half(color[c]);
                        std::memcpy(to, rounded.data(), stride);
                    } else {
                        std::memcpy(to, color.data(), stride);
                    }
                    keys[f] = s.key;
                    out.z[f] = s.z;
                    if (!by_ray && !(s.distance > 0)) continue;
                    const glm::dvec2 at(rays.point(glm::dvec2(x + lane, y) + view_.sample, 1) *
                                        glm::dvec3(1, -1, 1));
                    out.z[f] = by_ray ? depthOn(at, picture_.depths[index], s.z)
                                      : s.distance / static_cast<float>(std::hypot(at.x, at.y, 1));
                }
            });
    });
    if (by_ray || picture_.mixed) sortPixels(out);
}

}  // namespace peeler
