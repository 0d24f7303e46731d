// SPDX-License-Identifier: Apache-2.0
#include "core/image/merge.h"

#include <algorithm>
#include <cstring>
#include <limits>
#include <vector>

#include <peeler/error.h>

namespace peeler {
namespace {

constexpr std::size_t kNone = std::numeric_limits<std::size_t>::max();

constexpr const char* kTooManyFragments = "a band of rows has more than 2^32 fragments";
constexpr const char* kFewerFragments = "render a smaller picture, or fewer layers";

bool sameBytes(const FragmentArray& a, std::size_t first_a, const FragmentArray& b,
               std::size_t first_b, std::size_t count) {
    return std::memcmp(a.data.data() + first_a * a.stride(), b.data.data() + first_b * b.stride(),
                       count * a.stride()) == 0;
}

bool sameFragments(const LayeredImage& a, std::size_t pixel_a, const LayeredImage& b,
                   std::size_t pixel_b) {
    const std::size_t count = a.count(pixel_a);
    if (count != b.count(pixel_b)) return false;
    if (count == 0) return true;
    const std::size_t first_a = a.offsets[pixel_a], first_b = b.offsets[pixel_b];
    bool same = std::memcmp(&a.z[first_a], &b.z[first_b], count * sizeof(float)) == 0 &&
                sameBytes(a.color, first_a, b.color, first_b, count);
    for (std::size_t i = 0; same && i < a.extra.size(); ++i)
        same = sameBytes(a.extra[i], first_a, b.extra[i], first_b, count);
    return same;
}

/// Sets each pixel's owner in a row: the first tile that contains the pixel.
void findOwners(std::span<const LayeredImage> tiles, const Window& window, int y,
                std::vector<std::size_t>& owners) {
    owners.assign(static_cast<std::size_t>(window.width()), kNone);
    for (std::size_t t = tiles.size(); t-- > 0;) {
        const Window& tile = tiles[t].window;
        if (y < tile.y0 || y >= tile.y1) continue;
        std::fill(owners.begin() + (tile.x0 - window.x0), owners.begin() + (tile.x1 - window.x0),
                  t);
    }
}

void append(const FragmentArray& from, std::size_t first, std::size_t count, FragmentArray& to) {
    const std::byte* data = from.data.data() + first * from.stride();
    to.data.insert(to.data.end(), data, data + count * from.stride());
}

void clearLike(const LayeredImage& like, LayeredImage& out) {
    const auto reset = [](const FragmentArray& array, FragmentArray& target) {
        target.channels = array.channels;
        target.type = array.type;
        target.data.clear();
    };
    out.offsets.assign(1, 0);
    out.z.clear();
    reset(like.color, out.color);
    out.extra.resize(like.extra.size());
    for (std::size_t i = 0; i < out.extra.size(); ++i)
        reset(like.extra[i], out.extra[i]);
}

}  // namespace

std::optional<Window> findGap(std::span<const Window> tiles, const Window& whole) {
    // Between two successive tile edges, all rows are covered by the same tiles.
    std::vector<int> edges{whole.y0, whole.y1};
    for (const Window& tile : tiles) {
        for (const int y : {tile.y0, tile.y1}) {
            if (y > whole.y0 && y < whole.y1) edges.push_back(y);
        }
    }
    std::sort(edges.begin(), edges.end());
    std::vector<Window> across;
    for (std::size_t i = 0; i + 1 < edges.size(); ++i) {
        const int y0 = edges[i], y1 = edges[i + 1];
        if (y0 == y1) continue;
        across.clear();
        for (const Window& tile : tiles) {
            if (tile.y0 <= y0 && tile.y1 >= y1) across.push_back(tile);
        }
        std::sort(across.begin(), across.end(),
                  [](const Window& a, const Window& b) { return a.x0 < b.x0; });
        int x = whole.x0;
        for (const Window& tile : across) {
            if (tile.x0 > x) return Window{x, y0, std::min(tile.x0, whole.x1), y1};
            x = std::max(x, tile.x1);
        }
        if (x < whole.x1) return Window{x, y0, whole.x1, y1};
    }
    return std::nullopt;
}

bool overlap(std::span<const Window> tiles) {
    for (std::size_t i = 0; i < tiles.size(); ++i) {
        for (std::size_t j = 0; j < i; ++j) {
            if (!intersect(tiles[i], tiles[j]).empty()) return true;
        }
    }
    return false;
}

std::optional<Window> joinTiles(std::span<const LayeredImage> tiles, const Window& window,
                                const LayeredImage& like, LayeredImage& out) {
    out.window = window;
    clearLike(like, out);
    std::vector<std::size_t> owners;
    for (int y = window.y0; y < window.y1; ++y) {
        findOwners(tiles, window, y, owners);
        for (std::size_t t = 0; t < tiles.size(); ++t) {
            const LayeredImage& tile = tiles[t];
            if (y < tile.window.y0 || y >= tile.window.y1) continue;
            for (int x = tile.window.x0; x < tile.window.x1; ++x) {
                const std::size_t owner = owners[static_cast<std::size_t>(x - window.x0)];
                if (owner == t) continue;
                if (!sameFragments(tiles[owner], tiles[owner].pixelIndex(x, y), tile,
                                   tile.pixelIndex(x, y)))
                    return Window{x, y, x + 1, y + 1};
            }
        }
        // Copies each run of pixels that belong to the same tile at once, since their fragments are
        // contiguous.
        for (std::size_t begin = 0, end = 0; begin < owners.size(); begin = end) {
            while (end < owners.size() && owners[end] == owners[begin])
                ++end;
            if (owners[begin] == kNone) {
                out.offsets.insert(out.offsets.end(), end - begin, out.offsets.back());
                continue;
            }
            const LayeredImage& tile = tiles[owners[begin]];
            const std::size_t pixel = tile.pixelIndex(window.x0 + static_cast<int>(begin), y);
            const std::size_t first = tile.offsets[pixel];
            const std::size_t count = tile.offsets[pixel + end - begin] - first;
            if (out.fragments() + count > std::numeric_limits<std::uint32_t>::max()) {
                throw Error(ErrorKind::kMemory, kTooManyFragments, "", kFewerFragments);
            }
            // This is unsigned arithmetic: `base` may wrap around below 0, and the sums below wrap
            // back.
            const auto base = static_cast<std::uint32_t>(out.fragments() - first);
            for (std::size_t i = 1; i <= end - begin; ++i)
                out.offsets.push_back(base + tile.offsets[pixel + i]);
            if (count == 0) continue;
            out.z.insert(out.z.end(), tile.z.data() + first, tile.z.data() + first + count);
            append(tile.color, first, count, out.color);
            for (std::size_t i = 0; i < out.extra.size(); ++i)
                append(tile.extra[i], first, count, out.extra[i]);
        }
    }
    return std::nullopt;
}

void mergeByDepth(std::span<const LayeredImage> elements, const Window& window,
                  const LayeredImage& like, LayeredImage& out) {
    out.window = window;
    clearLike(like, out);
    std::vector<std::size_t> next(elements.size()), end(elements.size());
    for (int y = window.y0; y < window.y1; ++y) {
        for (int x = window.x0; x < window.x1; ++x) {
            for (std::size_t e = 0; e < elements.size(); ++e) {
                next[e] = end[e] = 0;
                const Window& own = elements[e].window;
                if (x < own.x0 || x >= own.x1 || y < own.y0 || y >= own.y1) continue;
                const std::size_t pixel = elements[e].pixelIndex(x, y);
                next[e] = elements[e].offsets[pixel];
                end[e] = elements[e].offsets[pixel + 1];
            }
            while (true) {
                std::size_t nearest = kNone;
                for (std::size_t e = 0; e < elements.size(); ++e) {
                    if (next[e] < end[e] &&
                        (nearest == kNone ||
                         elements[e].z[next[e]] < elements[nearest].z[next[nearest]]))
                        nearest = e;
                }
                if (nearest == kNone) break;
                const LayeredImage& element = elements[nearest];
                const std::size_t fragment = next[nearest]++;
                out.z.push_back(element.z[fragment]);
                append(element.color, fragment, 1, out.color);
                for (std::size_t i = 0; i < out.extra.size(); ++i)
                    append(element.extra[i], fragment, 1, out.extra[i]);
            }
            if (out.fragments() > std::numeric_limits<std::uint32_t>::max())
                throw Error(ErrorKind::kMemory, kTooManyFragments, "", kFewerFragments);
            out.offsets.push_back(static_cast<std::uint32_t>(out.fragments()));
        }
    }
}

}  // namespace peeler
