// SPDX-License-Identifier: Apache-2.0
#include "core/splats/splat_kernels.h"

#include <algorithm>
#include <bit>
#include <cmath>
#include <cstring>
#include <limits>
#include <utility>

#include "core/base/lanes.h"
#include "core/trace/eight_lanes.h"

namespace peeler {
namespace {

constexpr float kMostOpacity = 0.99F;
constexpr int kGroup = 8;  // pixels side by side that are computed together
constexpr EightInts kLaneNumbers = {0, 1, 2, 3, 4, 5, 6, 7};

PEELER_INLINE void loadEight(const float* from, EightFloats& to) {
    std::memcpy(&to, from, sizeof to);
}
template <class Lanes, class T>
PEELER_INLINE void storeEight(const Lanes& from, T* to) {
    static_assert(sizeof(Lanes) == kGroup * sizeof(T));
    std::memcpy(to, &from, sizeof from);
}

/// Computes e^x for x from −87 to 0, with the same bits on every machine: 2^k times a polynomial of
/// the rest (Cephes' coefficients). The relative error is below 2e-7.
PEELER_INLINE void exponentialOf(const EightFloats& x, EightFloats& result) {
    constexpr float kLog2E = 1.44269504F, kLn2High = 0.693359375F, kLn2Low = -2.12194440e-4F;
    const EightFloats scaled = x * kLog2E - 0.5F;
    const EightInts k =
        __builtin_convertvector(scaled, EightInts);  // rounds towards 0, x is negative
    const EightFloats whole = __builtin_convertvector(k, EightFloats);
    const EightFloats r = x - whole * kLn2High - whole * kLn2Low;
    EightFloats p = r * 1.9875691500e-4F + 1.3981999507e-3F;
    p = p * r + 8.3334519073e-3F;
    p = p * r + 4.1665795894e-2F;
    p = p * r + 1.6666665459e-1F;
    p = p * r + 5.0000001201e-1F;
    p = p * r * r + r + 1.0F;
    result = p * reinterpret_cast<EightFloats>((k + 127) << 23);
}

// Half floats from 0 to 65504, rounded to the nearest, at ties to even. Those below 2^-14 are
// multiples of 2^-24, as are floats from 0.5 to 1.
constexpr float kLeastNormalHalf = 0x1p-14F;
constexpr std::int32_t kBitsOfOneHalf = 0x3F000000, kRebiased = (127 - 15) << 23;

PEELER_INLINE void roundMantissa(const EightFloats& value, EightInts& bits) {
    bits = reinterpret_cast<EightInts>(value);
    bits += 0xFFF + (bits >> 13 & 1);
}

PEELER_INLINE void toHalfBits(const EightFloats& value, EightInts& half) {
    EightInts bits;
    roundMantissa(value, bits);
    const EightInts normal = (bits - kRebiased) >> 13;
    const EightFloats shifted = value + 0.5F;
    const EightInts small = reinterpret_cast<EightInts>(shifted) - kBitsOfOneHalf;
    half = value < kLeastNormalHalf ? small : normal;
}

PEELER_INLINE void roundToHalf(EightFloats& value) {
    EightInts bits;
    roundMantissa(value, bits);
    const EightFloats small = value + 0.5F - 0.5F;
    value = value < kLeastNormalHalf ? small : reinterpret_cast<EightFloats>(bits & ~0x1FFF);
}

/// Returns the rows or columns, within a range, whose samples lie in the interval middle ± half.
PEELER_INLINE std::pair<int, int> coveredBy(float middle, float half, float sample, int first,
                                            int end) {
    const float low = std::ceil(middle - half - sample), high = std::floor(middle + half - sample);
    if (!(low <= high)) return {first, first};
    return {static_cast<int>(std::max(low, static_cast<float>(first))),
            static_cast<int>(std::min(high, static_cast<float>(end - 1))) + 1};
}

/// Eight pixels side by side with fragments of a splat.
struct SplatGroup {
    std::uint32_t splat;
    int row, column;       ///< of the first pixel, in the tile
    EightFloats exponent;  ///< of the response
    EightInts kept;        ///< whether the pixel has a fragment

    std::size_t at() const {
        return static_cast<std::size_t>(row) * kTile + static_cast<std::size_t>(column);
    }
};

/// Computes the Z of a splat's fragments.
PEELER_INLINE void depthsOf(const SplatTile& tile, const SplatGroup& group, EightFloats& z) {
    const ProjectedSplat& s = tile.picture.splats[group.splat];
    const EightFloats constant = EightFloats{} + s.z;
    z = constant;
    if (s.distance > 0) {
        EightFloats length;
        loadEight(tile.lengths + group.at(), length);
        z = s.distance / length;
    }
    if (tile.picture.depths.empty()) return;
    const SplatDepth& depth = tile.picture.depths[group.splat];
    const auto& p = depth.precision;
    EightFloats x;
    loadEight(tile.ray_x + group.column, x);
    const float y = tile.ray_y[group.row];
    if (tile.perspective) {
        const EightFloats to = depth.along[0] * x + depth.along[1] * y + depth.along[2];
        const EightFloats square =
            (p[0] * x + 2 * (p[1] * y + p[2])) * x + ((p[3] * y + 2 * p[4]) * y + p[5]);
        z = to / square;
    } else {
        z = (depth.along[2] - p[2] * x - p[4] * y) / p[5];
    }
    const EightInts valid = (z > 0) & (z <= std::numeric_limits<float>::max());
    z = valid ? z : constant;
}

/// Calls use(splat) for every splat of a tile. Fetches them ahead of use, since they are far apart.
template <class Use>
PEELER_INLINE void forSplats(const SplatTile& tile, const Use& use) {
    constexpr std::size_t kAhead = 3;
    const bool by_ray = !tile.picture.depths.empty();
    for (std::size_t i = 0; i < tile.splats.size(); ++i) {
        const std::size_t ahead = std::min(i + kAhead, tile.splats.size() - 1);
        __builtin_prefetch(&tile.picture.splats[tile.splats[ahead]]);
        if (by_ray) __builtin_prefetch(&tile.picture.depths[tile.splats[ahead]]);
        use(tile.splats[i]);
    }
}

/// Calls visit(group) for the groups of pixels in which a splat has fragments.
template <class Visit>
PEELER_INLINE void forGroups(const SplatTile& tile, std::uint32_t splat, const Visit& visit) {
    const ProjectedSplat& s = tile.picture.splats[splat];
    const Window& window = tile.window;
    const auto [top, bottom] = coveredBy(s.y, s.half_height, tile.sample_y, window.y0, window.y1);
    const auto [left, right] = coveredBy(s.x, s.half_width, tile.sample_x, window.x0, window.x1);
    SplatGroup group;
    group.splat = splat;
    for (group.column = 0; group.column < kTile; group.column += kGroup) {
        const int first = tile.x0 + group.column;
        if (left >= first + kGroup || right <= first) continue;
        const EightInts inside = (kLaneNumbers >= left - first) & (kLaneNumbers < right - first);
        const EightFloats dx =
            __builtin_convertvector(kLaneNumbers + first, EightFloats) + (tile.sample_x - s.x);
        for (int y = top; y < bottom; ++y) {
            const float dy = static_cast<float>(y) + tile.sample_y - s.y;
            group.row = y - tile.y0;
            const EightFloats share = (dx - s.lean * dy) * s.across;
            const float down = dy * s.down;
            group.exponent = -(share * share) - down * down;
            group.kept = (group.exponent >= s.least) & inside;
            if (tile.hides) {
                EightFloats z, hidden_from;
                depthsOf(tile, group, z);
                loadEight(tile.hidden_from + group.at(), hidden_from);
                group.kept &= z < hidden_from;
            }
            visit(s, group);
        }
    }
}

PEELER_INLINE std::size_t findIn(const SplatBoxes& boxes, std::size_t from,
                                 const float (&window)[4], std::uint32_t* found, std::size_t room,
                                 std::size_t& count) {
    count = 0;
    const std::size_t end = boxes.low_x.size();
    std::size_t i = from / kGroup * kGroup;
    for (; i < end && count + kGroup <= room; i += kGroup) {
        EightFloats low, high;
        loadEight(boxes.low_y.data() + i, low);
        loadEight(boxes.high_y.data() + i, high);
        EightInts touches = (low <= window[3]) & (high >= window[1]);
        loadEight(boxes.low_x.data() + i, low);
        loadEight(boxes.high_x.data() + i, high);
        touches &= (low <= window[2]) & (high >= window[0]);
        unsigned bits = bitsOf(touches);
        if (i < from) bits &= ~0U << (from - i);
        for (; bits != 0; bits &= bits - 1)
            found[count++] =
                static_cast<std::uint32_t>(i) + static_cast<std::uint32_t>(std::countr_zero(bits));
    }
    return std::max(i, from);
}

PEELER_INLINE void countIn(const SplatTile& tile, std::uint32_t* counts) {
    forSplats(
        tile, [&](std::uint32_t splat) __attribute__((always_inline)) {
            forGroups(
                tile, splat,
                [&](const ProjectedSplat&, const SplatGroup& group) __attribute__((always_inline)) {
                    EightInts sum;
                    std::memcpy(&sum, counts + group.at(), sizeof sum);
                    sum -= group.kept;
                    std::memcpy(counts + group.at(), &sum, sizeof sum);
                });
        });
}

/// The fragments of a splat in a tile, in arrays without gaps.
struct SplatFragments {
    std::size_t count = 0;
    std::uint32_t places[kTilePixels];  ///< indices where they are stored
    float exponents[kTilePixels + kGroup]{}, z[kTilePixels + kGroup]{};
    float colors[4][kTilePixels + kGroup];
    std::uint32_t halfs[2][kTilePixels + kGroup];
};

PEELER_INLINE void shadeFragments(const ProjectedSplat& s, bool half, SplatFragments& fragments) {
    for (std::size_t i = 0; i < fragments.count; i += kGroup) {
        EightFloats exponent, response;
        loadEight(fragments.exponents + i, exponent);
        exponentialOf(exponent, response);
        const EightFloats opacity = s.opacity * response;
        const EightFloats alpha = opacity < kMostOpacity ? opacity : EightFloats{} + kMostOpacity;
        const EightFloats color[4] = {s.red * alpha, s.green * alpha, s.blue * alpha, alpha};
        if (half) {
            EightInts bits[4];
            for (int c = 0; c < 4; ++c)
                toHalfBits(color[c], bits[c]);
            storeEight(bits[0] | bits[1] << 16, fragments.halfs[0] + i);
            storeEight(bits[2] | bits[3] << 16, fragments.halfs[1] + i);
        } else {
            for (int c = 0; c < 4; ++c)
                storeEight(color[c], fragments.colors[c] + i);
        }
    }
}

PEELER_INLINE void storeColors(const SplatFragments& fragments, std::size_t i,
                               const SplatStore& store, std::uint32_t place) {
    const std::size_t components = store.components;
    if (store.half) {
        std::byte* const to = store.colors + place * components * sizeof(std::uint16_t);
        const std::uint64_t rgba = fragments.halfs[0][i] | std::uint64_t{fragments.halfs[1][i]}
                                                               << 32;
        std::memcpy(to, &rgba, sizeof rgba);
        const auto alpha = static_cast<std::uint16_t>(rgba >> 48);
        for (std::size_t c = 4; c < components; ++c)
            std::memcpy(to + c * sizeof alpha, &alpha, sizeof alpha);
    } else {
        std::byte* const to = store.colors + place * components * sizeof(float);
        for (std::size_t c = 0; c < components; ++c)
            std::memcpy(to + c * sizeof(float), fragments.colors[std::min<std::size_t>(c, 3)] + i,
                        sizeof(float));
    }
}

PEELER_INLINE void captureIn(const SplatTile& tile, SplatStore& store) {
    SplatFragments fragments;
    const bool by_ray = !tile.picture.depths.empty();
    const std::size_t stride =
        store.components * (store.half ? sizeof(std::uint16_t) : sizeof(float));
    forSplats(
        tile, [&](std::uint32_t splat) __attribute__((always_inline)) {
            fragments.count = 0;
            forGroups(
                tile, splat,
                [&](const ProjectedSplat& s, const SplatGroup& group)
                    __attribute__((always_inline)) {
                        unsigned bits = bitsOf(group.kept);
                        if (bits == 0) return;
                        float exponents[kGroup], z[kGroup];
                        storeEight(group.exponent, exponents);
                        EightFloats depths = EightFloats{} + s.z;
                        if (by_ray || s.distance > 0) depthsOf(tile, group, depths);
                        storeEight(depths, z);
                        for (; bits != 0; bits &= bits - 1) {
                            const auto lane = static_cast<unsigned>(std::countr_zero(bits));
                            const std::uint32_t place = store.next[group.at() + lane]++;
                            __builtin_prefetch(store.colors + place * stride, 1);
                            __builtin_prefetch(store.z + place, 1);
                            __builtin_prefetch(store.keys + place, 1);
                            const std::size_t i = fragments.count++;
                            fragments.places[i] = place;
                            fragments.exponents[i] = exponents[lane];
                            fragments.z[i] = z[lane];
                        }
                    });
            const ProjectedSplat& s = tile.picture.splats[splat];
            shadeFragments(s, store.half, fragments);
            for (std::size_t i = 0; i < fragments.count; ++i) {
                const std::uint32_t place = fragments.places[i];
                store.z[place] = fragments.z[i];
                store.keys[place] = s.key;
                storeColors(fragments, i, store, place);
            }
        });
}

PEELER_INLINE bool isFinal(const SplatBlend& blend) {
    EightInts open{};
    for (std::size_t i = 0; i < kTilePixels; i += kGroup) {
        EightFloats alpha;
        EightInts left;
        loadEight(blend.color[3] + i, alpha);
        std::memcpy(&left, blend.left + i, sizeof left);
        open |= (alpha != 1.0F) & (left > 0);
    }
    return bitsOf(open) == 0;
}

PEELER_INLINE void blendGroup(const SplatTile& tile, const ProjectedSplat& s,
                              const SplatGroup& group, SplatBlend& blend) {
    const std::size_t at = group.at();
    EightFloats alpha, response, sum, z, nearest;
    EightInts left;
    std::memcpy(&left, blend.left + at, sizeof left);
    loadEight(blend.color[3] + at, sum);
    const EightFloats rest = 1.0F - sum;
    const EightInts kept = group.kept & (left > 0) & (rest != 0);
    if (bitsOf(kept) == 0) return;
    left += kept;
    std::memcpy(blend.left + at, &left, sizeof left);

    depthsOf(tile, group, z);
    loadEight(blend.z + at, nearest);
    nearest = (kept & (z < nearest)) ? z : nearest;
    storeEight(nearest, blend.z + at);

    exponentialOf(group.exponent, response);
    const EightFloats opacity = s.opacity * response;
    alpha = opacity < kMostOpacity ? opacity : EightFloats{} + kMostOpacity;
    // Other pixels get a colour of 0, which changes nothing.
    alpha = kept ? alpha : EightFloats{};
    const EightFloats color[4] = {s.red * alpha, s.green * alpha, s.blue * alpha, alpha};
    for (int c = 0; c < 4; ++c) {
        EightFloats rounded = color[c];
        if (blend.half) roundToHalf(rounded);
        loadEight(blend.color[c] + at, sum);
        sum += rest * rounded;
        storeEight(sum, blend.color[c] + at);
    }
}

PEELER_INLINE bool blendIn(const SplatTile& tile, SplatBlend& blend) {
    constexpr std::size_t kSplatsPerCheck = 64;
    for (std::size_t i = 0; i < tile.splats.size(); ++i) {
        if (i % kSplatsPerCheck == 0 && isFinal(blend)) return true;
        forGroups(
            tile, tile.splats[i],
            [&](const ProjectedSplat& s, const SplatGroup& group)
                __attribute__((always_inline)) { blendGroup(tile, s, group, blend); });
    }
    return isFinal(blend);
}

// The functions above, compiled for every processor and for AVX2.
std::size_t findOnEvery(const SplatBoxes& boxes, std::size_t from, const float (&window)[4],
                        std::uint32_t* found, std::size_t room, std::size_t& count) {
    return findIn(boxes, from, window, found, room, count);
}
void countOnEvery(const SplatTile& tile, std::uint32_t* counts) {
    countIn(tile, counts);
}
void captureOnEvery(const SplatTile& tile, SplatStore& store) {
    captureIn(tile, store);
}
bool blendOnEvery(const SplatTile& tile, SplatBlend& blend) {
    return blendIn(tile, blend);
}
constexpr SplatKernels kSplatsOnEvery = {findOnEvery, countOnEvery, captureOnEvery, blendOnEvery};

#ifdef __x86_64__
[[gnu::target("avx2")]] std::size_t findOnAvx2(const SplatBoxes& boxes, std::size_t from,
                                               const float (&window)[4], std::uint32_t* found,
                                               std::size_t room, std::size_t& count) {
    return findIn(boxes, from, window, found, room, count);
}
[[gnu::target("avx2")]] void countOnAvx2(const SplatTile& tile, std::uint32_t* counts) {
    countIn(tile, counts);
}
[[gnu::target("avx2")]] void captureOnAvx2(const SplatTile& tile, SplatStore& store) {
    captureIn(tile, store);
}
[[gnu::target("avx2")]] bool blendOnAvx2(const SplatTile& tile, SplatBlend& blend) {
    return blendIn(tile, blend);
}
constexpr SplatKernels kSplatsOnAvx2 = {findOnAvx2, countOnAvx2, captureOnAvx2, blendOnAvx2};
#endif

}  // namespace

const SplatKernels& splatKernelsFor([[maybe_unused]] bool every_processor) {
#ifdef __x86_64__
    if (hasAvx2() && !every_processor) return kSplatsOnAvx2;
#endif
    return kSplatsOnEvery;
}

}  // namespace peeler
