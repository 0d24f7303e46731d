// SPDX-License-Identifier: Apache-2.0
#include "core/splats/splat_layers.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <limits>
#include <numeric>

#include "core/base/parallel.h"
#include "core/base/resize_anew.h"
#include "core/fragments/supersampling.h"
#include "core/image/channels.h"
#include "core/scene/view.h"
#include "core/splats/splat_sorter.h"

namespace peeler {
namespace {

// The most splats of a batch, and of their listings in tiles.
constexpr std::size_t kSplatsOfBatch = std::size_t{1} << 15, kListedOfBatch = std::size_t{1} << 18;
constexpr std::size_t kTasksPerThread = 4;

/// Returns the multiple of kTile at or before a coordinate.
int tileStart(int x) {
    return x - (x % kTile + kTile) % kTile;
}

/// Calls use(index in the tile's arrays, index in the band's) for every pixel of a tile that is in
/// the band.
template <class Use>
void forPixels(const SplatTile& tile, const Window& band, const Use& use) {
    for (int y = tile.window.y0; y < tile.window.y1; ++y) {
        auto own = static_cast<std::size_t>((y - tile.y0) * kTile + tile.window.x0 - tile.x0);
        std::size_t of_band =
            static_cast<std::size_t>(y - band.y0) * static_cast<std::size_t>(band.width()) +
            static_cast<std::size_t>(tile.window.x0 - band.x0);
        for (int x = tile.window.x0; x < tile.window.x1; ++x)
            use(own++, of_band++);
    }
}

}  // namespace

/// Some splats, in order, and the lists of those of each tile of a block.
struct SplatLayers::Batch {
    std::vector<std::uint32_t> found;
    std::vector<std::array<std::uint16_t, 2>> tiles;  ///< begin and end of each found splat's
    std::vector<std::uint32_t> first, next;           ///< of each tile, in `listed`
    std::vector<std::uint32_t> listed;                ///< indices into SplatPicture::splats
    std::vector<char> done;  ///< whether farther splats of a tile change nothing
    SplatSorter sorter;

    static std::uint64_t bytes(std::uint64_t across) {
        return kSplatsOfBatch * 8 + across * 9 + (kListedOfBatch + across) * 4 +
               SplatSorter::kBytes;
    }
    std::span<const std::uint32_t> of(std::size_t tile) const {
        return std::span(listed).subspan(first[tile], first[tile + 1] - first[tile]);
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

void SplatLayers::project() {
    if (!std::exchange(projected_, true)) picture_ = projectSplats(posed_, view_, settings_);
}

std::uint64_t SplatLayers::bytes() const {
    std::uint64_t splats = 0;
    for (const DrawnSurface& surface : posed_.drawList().surfaces()) {
        const MeshInstance& instance = posed_.meshes()[surface.instance];
        const Primitive& primitive = posed_.primitives(instance)[surface.primitive];
        if (primitive.splats) splats += primitive.splats->size();
    }
    const auto across = static_cast<std::uint64_t>(view_.crop.width()) / kTile + 2;
    return projectionBytes(splats, settings_) +
           static_cast<std::uint64_t>(threadCount()) * Batch::bytes(across);
}

/// Lists the next splats of the tiles of a block, from `from` on, which is set to the first after
/// the batch.
void SplatLayers::listTiles(const Window& block, std::size_t& from, Batch& batch) const {
    // Samples lie in their pixels. A margin makes up for rounding.
    const float window[4] = {static_cast<float>(block.x0 - 1), static_cast<float>(block.y0 - 1),
                             static_cast<float>(block.x1 + 1), static_cast<float>(block.y1 + 1)};
    batch.found.resize(kSplatsOfBatch);
    std::size_t found = 0;
    from = kernels_->find(picture_.boxes, from, window, batch.found.data(), kSplatsOfBatch, found);
    const int x0 = tileStart(block.x0);
    const auto across = static_cast<std::size_t>(block.x1 - x0 + kTile - 1) / kTile;
    batch.first.assign(across + 1, 0);
    batch.tiles.clear();
    std::size_t listed = 0;
    const auto column = [&](float x) {
        return static_cast<std::size_t>(
                   std::clamp(x, static_cast<float>(block.x0), static_cast<float>(block.x1 - 1)) -
                   static_cast<float>(x0)) /
               kTile;
    };
    for (std::size_t k = 0; k < found; ++k) {
        const std::uint32_t i = batch.found[k];
        const std::size_t begin = column(picture_.boxes.low_x[i] - 1),
                          end = column(picture_.boxes.high_x[i] + 1) + 1;
        listed += end - begin;
        if (k > 0 && listed > kListedOfBatch) {
            from = i;
            break;
        }
        batch.tiles.push_back({static_cast<std::uint16_t>(begin), static_cast<std::uint16_t>(end)});
        for (std::size_t t = begin; t < end; ++t)
            ++batch.first[t + 1];
    }
    std::partial_sum(batch.first.begin(), batch.first.end(), batch.first.begin());
    batch.listed.resize(batch.first.back());
    batch.next.assign(batch.first.begin(), batch.first.end() - 1);
    for (std::size_t k = 0; k < batch.tiles.size(); ++k)
        for (std::size_t t = batch.tiles[k][0]; t < batch.tiles[k][1]; ++t)
            batch.listed[batch.next[t]++] = batch.found[k];
}

SplatTile SplatLayers::tileAt(int x0, int y0, const Window& window) const {
    SplatTile tile{.picture = picture_, .splats = {}, .x0 = x0, .y0 = y0, .window = window};
    tile.sample_x = static_cast<float>(view_.sample.x);
    tile.sample_y = static_cast<float>(view_.sample.y);
    tile.perspective = view_.projection.perspective;
    const PixelRays rays(view_);
    for (int i = 0; i < kTile; ++i) {
        const glm::dvec3 point = rays.point(glm::dvec2(x0 + i, y0 + i) + view_.sample, 1);
        tile.ray_x[i] = static_cast<float>(point.x);
        tile.ray_y[i] = static_cast<float>(-point.y);
    }
    if (!picture_.by_distance) return tile;
    for (int i = 0; i < kTile * kTile; ++i) {
        const double x{tile.ray_x[i % kTile]}, y{tile.ray_y[i / kTile]};
        tile.lengths[i] = static_cast<float>(std::sqrt(x * x + y * y + 1));
    }
    return tile;
}

/// Calls visit(tile) for the tiles of a band and batches of their splats, nearest first. A tile
/// for which it returns true is not visited again. Calls finish(block, batch) for every block of
/// tiles at last.
template <class Visit, class Finish>
void SplatLayers::forTiles(const Window& band, Hiding hiding, const Visit& visit,
                           const Finish& finish) {
    project();
    const int x0 = tileStart(band.x0), y0 = tileStart(band.y0);
    const int across = (band.x1 - x0 + kTile - 1) / kTile,
              down = (band.y1 - y0 + kTile - 1) / kTile;
    const int tasks = static_cast<int>(kTasksPerThread) * threadCount();
    const int blocks = threadCount() == 1 ? 1 : std::clamp((tasks + down - 1) / down, 1, across);
    ObjectPool<Batch> batches;
    const auto visitBlock = [&](std::size_t task, Batch& batch) {
        const int row = static_cast<int>(task) / blocks, part = static_cast<int>(task) % blocks;
        const int begin = across * part / blocks, end = across * (part + 1) / blocks;
        const int y = y0 + row * kTile;
        const Window block = intersect({x0 + begin * kTile, y, x0 + end * kTile, y + kTile}, band);
        const auto tiles = static_cast<std::size_t>(end - begin);
        batch.done.assign(tiles, 0);
        for (std::size_t from = 0, done = 0; from < picture_.splats.size() && done < tiles;) {
            listTiles(block, from, batch);
            for (std::size_t t = 0; t < tiles; ++t) {
                if (batch.done[t] || batch.of(t).empty()) continue;
                const int x = x0 + (begin + static_cast<int>(t)) * kTile;
                SplatTile tile = tileAt(x, y, intersect({x, y, x + kTile, y + kTile}, band));
                tile.splats = batch.of(t);
                tile.hides = !hiding.empty();
                if (tile.hides)
                    forPixels(tile, band, [&](std::size_t own, std::size_t of_band) {
                        tile.hidden_from[own] = hiding[of_band];
                    });
                batch.done[t] = visit(std::as_const(tile));
                done += batch.done[t] ? 1 : 0;
            }
        }
        finish(block, batch);
    };
    parallelFor(
        static_cast<std::size_t>(down) * static_cast<std::size_t>(blocks),
        [&](std::size_t task) { batches.with([&](Batch& batch) { visitBlock(task, batch); }); });
}

void SplatLayers::addCounts(const Window& band, std::span<std::uint32_t> counts, Hiding hiding) {
    forTiles(
        band, hiding,
        [&](const SplatTile& tile) {
            std::uint32_t own_counts[kTilePixels]{};
            kernels_->count(tile, own_counts);
            forPixels(tile, band, [&](std::size_t own, std::size_t of_band) {
                counts[of_band] += own_counts[own];
            });
            return false;
        },
        [](const Window&, Batch&) {});
}

void SplatLayers::capture(const Window& band, std::span<const std::uint32_t> counts,
                          LayeredImage& out, Hiding hiding) {
    out.window = band;
    resizeAnew(out.offsets, band.pixels() + 1);
    out.offsets[0] = 0;
    std::partial_sum(counts.begin(), counts.end(), out.offsets.begin() + 1);
    std::vector<std::uint32_t> next(out.offsets.begin(), out.offsets.end() - 1);
    const std::size_t fragments = out.offsets.back();
    resizeAnew(out.z, fragments);
    out.color.type = settings_.color_type;
    out.color.channels = colorNames(settings_.tinted);
    resizeAnew(out.color.data, fragments * out.color.stride());
    out.extra.resize(1);
    out.extra.front().channels = {kKeyChannel};
    out.extra.front().type = PixelType::kUint;
    resizeAnew(out.extra.front().data, fragments * sizeof(std::uint32_t));
    const std::span<std::uint32_t> keys = out.extra.front().as<std::uint32_t>();
    const bool sorts = !sameOrderEverywhere();
    forTiles(
        band, hiding,
        [&](const SplatTile& tile) {
            SplatStore store{.z = out.z.data(),
                             .keys = keys.data(),
                             .colors = out.color.data.data(),
                             .half = settings_.color_type == PixelType::kHalf,
                             .components = out.color.components()};
            forPixels(tile, band, [&](std::size_t own, std::size_t of_band) {
                store.next[own] = next[of_band];
            });
            kernels_->capture(tile, store);
            forPixels(tile, band, [&](std::size_t own, std::size_t of_band) {
                next[of_band] = store.next[own];
            });
            return false;
        },
        [&](const Window& block, Batch& batch) {
            if (sorts) batch.sorter.sort(block, out);
        });
}

void SplatLayers::capture(const Window& band, LayeredImage& out) {
    std::vector<std::uint32_t> counts(band.pixels());
    addCounts(band, counts);
    capture(band, counts, out);
}

bool SplatLayers::sameOrderEverywhere() {
    project();
    return settings_.splat_order == SplatOrder::kCenter && !picture_.mixed;
}

void SplatLayers::composite(const Window& band, std::uint32_t layers, CompositeImage& out) {
    const std::size_t pixels = band.pixels();
    out.window = band;
    out.rgba.assign(pixels, {});
    out.opacity.assign(settings_.tinted ? pixels : 0, {});
    out.z.assign(pixels, std::numeric_limits<float>::infinity());
    constexpr std::int32_t kMost = std::numeric_limits<std::int32_t>::max();
    std::vector<std::int32_t> left(
        layers ? pixels : 0, static_cast<std::int32_t>(std::min<std::uint32_t>(layers, kMost)));
    forTiles(
        band, {},
        [&](const SplatTile& tile) {
            SplatBlend blend{.half = settings_.color_type == PixelType::kHalf};
            forPixels(tile, band, [&](std::size_t own, std::size_t of_band) {
                for (std::size_t c = 0; c < 4; ++c)
                    blend.color[c][own] = out.rgba[of_band][c];
                blend.z[own] = out.z[of_band];
                blend.left[own] = layers ? left[of_band] : kMost;
            });
            const bool final = kernels_->blend(tile, blend);
            forPixels(tile, band, [&](std::size_t own, std::size_t of_band) {
                for (std::size_t c = 0; c < 4; ++c)
                    out.rgba[of_band][c] = blend.color[c][own];
                // The opacity of splats has no colour.
                const float alpha = blend.color[3][own];
                if (settings_.tinted) out.opacity[of_band] = {alpha, alpha, alpha};
                out.z[of_band] = blend.z[own];
                if (layers) left[of_band] = blend.left[own];
            });
            return final;
        },
        [](const Window&, Batch&) {});
}

}  // namespace peeler
