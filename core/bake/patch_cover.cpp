// SPDX-License-Identifier: Apache-2.0
// Search for the receivers that triangles cover.
#include <algorithm>
#include <cstring>
#include <utility>

#include "core/bake/occluders.h"
#include "core/base/lanes.h"
#include "core/scene/elements.h"

namespace peeler {
namespace {

// Triangles extend beyond their edges by this share of their size.
constexpr float kBeyondEdges = 1e-6F;
// The maximum number of rows of cells for the simple method, which tests all receivers in the
// triangle's bounding box. Few of these receivers lie outside such a small triangle. Larger
// triangles are scan-converted.
constexpr int kPlainRows = 3;
// The maximum slope of a triangle, depth over width. Steeper triangles are ignored: they are nearly
// edge-on and hide almost nothing, but rounding errors in their depth could hide receivers that lie
// on them.
constexpr float kSteepest = 500;
// The distance, in columns, by which edges are moved outwards to allow for rounding.
constexpr float kColumnSlack = 1e-3F;

/// SIMD vectors (compiler extension), 16 and 32 bytes wide.
using FourLanes = float __attribute__((vector_size(4 * sizeof(float))));
using EightLanes = float __attribute__((vector_size(8 * sizeof(float))));

/// A projected triangle: the position of its first corner. For each of the other two corners: the
/// gradient of its barycentric weight, and its depth relative to the first corner.
struct FacingTriangle {
    float x = 0, y = 0, z = 0;
    float second_x = 0, second_y = 0, third_x = 0, third_y = 0;
    float second_z = 0, third_z = 0;
    float side = 0;  // `side` of the receivers that can see the triangle
    std::uint32_t element = 0;
};

/// A SIMD test of the receivers with the indices first … end − 1. Rounds the range up to whole
/// blocks.
template <class Lanes, bool kOneSided>
struct LaneCover {
    static constexpr bool kNeedsSide = kOneSided;

    LaneCover(const OccluderPiece&, const CellReceivers& receivers) : r(receivers) {}

    PEELER_INLINE void operator()(const FacingTriangle& t, std::size_t first,
                                  std::size_t end) const {
        constexpr std::size_t kLanes = sizeof(Lanes) / sizeof(float);
        for (std::size_t block = first; block < end; block += CellReceivers::kBlock) {
            for (std::size_t i = block; i < block + CellReceivers::kBlock; i += kLanes) {
                Lanes x, y, z, side, before;
                std::memcpy(&x, r.at[0] + i, sizeof x);
                std::memcpy(&y, r.at[1] + i, sizeof y);
                std::memcpy(&z, r.at[2] + i, sizeof z);
                std::memcpy(&side, r.side + i, sizeof side);
                std::memcpy(&before, r.nearest + i, sizeof before);
                x -= t.x;
                y -= t.y;
                const Lanes second = x * t.second_x + y * t.second_y;
                const Lanes third = x * t.third_x + y * t.third_y;
                const Lanes rest = 1.0F - second - third;
                const Lanes distance = (second * t.second_z + third * t.third_z + (t.z - z)) * side;
                auto hit = (second >= -kBeyondEdges) & (third >= -kBeyondEdges) &
                           (rest >= -kBeyondEdges) & (distance > r.own_surface) &
                           (distance < before);
                if constexpr (kOneSided) hit &= side == t.side;
                const Lanes after = hit ? distance : before;
                std::memcpy(r.nearest + i, &after, sizeof after);
            }
        }
    }

    CellReceivers r;  // a copy, so that the compiler can rule out aliasing
};

/// The scalar test, for surfaces with an alpha test.
class TestedCover {
  public:
    static constexpr bool kNeedsSide = true;

    TestedCover(const OccluderPiece& piece, const CellReceivers& receivers)
        : piece_(piece), r_(receivers), one_sided_(piece.cull_front || piece.cull_back) {}

    void operator()(const FacingTriangle& t, std::size_t first, std::size_t end) const {
        for (std::size_t i = first; i < end; ++i) {
            const float x = r_.at[0][i] - t.x, y = r_.at[1][i] - t.y;
            const float second = x * t.second_x + y * t.second_y;
            const float third = x * t.third_x + y * t.third_y, rest = 1.0F - second - third;
            const float distance =
                (second * t.second_z + third * t.third_z + (t.z - r_.at[2][i])) * r_.side[i];
            if (second >= -kBeyondEdges && third >= -kBeyondEdges && rest >= -kBeyondEdges &&
                distance > r_.own_surface && distance < r_.nearest[i] &&
                (!one_sided_ || r_.side[i] == t.side) && covers(t.element, second, third))
                r_.nearest[i] = distance;
        }
    }

  private:
    bool covers(std::uint32_t element, float second, float third) const {
        const double b = std::max(0.0, double{second}), c = std::max(0.0, double{third});
        const double a = std::max(0.0, 1 - double{second} - double{third}), sum = a + b + c;
        std::array<std::uint32_t, 3> vertex{};
        std::ranges::transform(cornersOf(*piece_.primitive, element).vertex, vertex.begin(),
                               [](std::size_t v) { return static_cast<std::uint32_t>(v); });
        return piece_.alpha->passes(vertex, {a / sum, b / sum, c / sum});
    }

    const OccluderPiece& piece_;
    const CellReceivers& r_;
    bool one_sided_;
};

/// Tests the receivers between the triangle's edges, in columns x0 … x1 and rows y0 … y1. a, b and
/// c are the triangle's corners.
template <class Cover>
PEELER_INLINE void coverRows(const Cover& cover, const FacingTriangle& triangle, glm::vec2 a,
                             glm::vec2 b, glm::vec2 c, int x0, int x1, int y0, int y1,
                             const CellReceivers& r) {
    if (b.y < a.y) std::swap(a, b);
    if (c.y < b.y) std::swap(b, c);
    if (b.y < a.y) std::swap(a, b);
    const auto slope = [](const glm::vec2& from, const glm::vec2& to) {
        return to.y > from.y ? (to.x - from.x) / (to.y - from.y) : 0;
    };
    const float along = slope(a, c), upper = slope(a, b), lower = slope(b, c);
    // Return x at height y: on the long edge (a, c), and on the short edges (a, b) and (b, c).
    const auto one_at = [&](float y) { return a.x + (y - a.y) * along; };
    const auto other_at = [&](float y) {
        return y < b.y ? a.x + (y - a.y) * upper : b.x + (y - b.y) * lower;
    };
    const float top = std::max(static_cast<float>(y0), a.y);
    float one = one_at(top), other = other_at(top);
    const std::uint32_t* row = r.first + std::size_t(y0) * std::size_t(r.width);
    for (int y = y0; y <= y1; ++y, row += r.width) {
        const float bottom = std::min(static_cast<float>(y + 1), c.y);
        const float next_one = one_at(bottom), next_other = other_at(bottom);
        float left = std::min({one, other, next_one, next_other});
        float right = std::max({one, other, next_one, next_other});
        if (b.y >= static_cast<float>(y) && b.y <= bottom) {
            left = std::min(left, b.x);
            right = std::max(right, b.x);
        }
        one = next_one;
        other = next_other;
        left -= kColumnSlack;
        right += kColumnSlack;
        const auto first = static_cast<float>(x0), last = static_cast<float>(x1);
        if (left > last + 1 || right < first) continue;
        const int from = left > first ? static_cast<int>(left) : x0;
        const int to = right < last ? static_cast<int>(right) : x1;
        if (from <= to) cover(triangle, row[from], row[to + 1]);
    }
}

/// The projected triangles of a patch. For each triangle: the cells that it may cover.
struct PlacedTriangles {
    static constexpr std::size_t kMost = OccluderPatch::kMost;
    using Values = std::array<float, kMost>;

    Values corner[3];                       // x, y and z of the patch's corners
    Values a[3], b[3], c[3];                // x, y and z of each triangle's corners
    Values inverse_area;                    // 1 / (twice the area)
    std::array<int, kMost> x0, x1, y0, y1;  // cells to test; empty if x1 < x0 or y1 < y0
};

PEELER_INLINE float leastOf(float a, float b, float c) {
    const float ab = a < b ? a : b;
    return ab < c ? ab : c;
}
PEELER_INLINE float mostOf(float a, float b, float c) {
    const float ab = a > b ? a : b;
    return ab > c ? ab : c;
}

/// Sets first … last to the range of cells between two coordinates. The range is empty if it lies
/// outside the grid.
PEELER_INLINE void cellsBetween(float from, float to, float cells, int& first, int& last) {
    const float begin = from > 0 ? from : 0;
    first = static_cast<int>(begin < cells ? begin : cells);
    const float end = to < cells - 1 ? to : cells - 1;
    last = static_cast<int>((end > -1 ? end : -1) + 1) - 1;
}

PEELER_INLINE void placeTriangles(const Occluders& occluders, const OccluderPatch& patch,
                                  const PatchView& view, const CellReceivers& r,
                                  PlacedTriangles& p) {
    const float *const x = occluders.coordinates(patch, 0),
                       *const y = occluders.coordinates(patch, 1),
                       *const z = occluders.coordinates(patch, 2);
    for (std::size_t axis = 0; axis < 3; ++axis) {
        const glm::vec4 row = view.rows[axis];
        float* const out = p.corner[axis].data();
        for (std::size_t i = 0; i < patch.corners; ++i)
            out[i] = row.x * x[i] + row.y * y[i] + (row.z * z[i] + row.w);
    }
    const auto triangles = occluders.triangles(patch);
    for (std::size_t axis = 0; axis < 3; ++axis) {
        const float* const from = p.corner[axis].data();
        for (std::size_t i = 0; i < triangles.size(); ++i) {
            p.a[axis][i] = from[triangles[i][0]];
            p.b[axis][i] = from[triangles[i][1]];
            p.c[axis][i] = from[triangles[i][2]];
        }
    }
    const auto width = static_cast<float>(r.width), height = static_cast<float>(r.height);
    const float column = r.units_a_cell.x, row = r.units_a_cell.y;
    for (std::size_t i = 0; i < triangles.size(); ++i) {
        const float ax = p.a[0][i], bx = p.b[0][i], cx = p.c[0][i];
        const float ay = p.a[1][i], by = p.b[1][i], cy = p.c[1][i];
        const float az = p.a[2][i], bz = p.b[2][i], cz = p.c[2][i];
        const float left = leastOf(ax, bx, cx), right = mostOf(ax, bx, cx);
        const float top = leastOf(ay, by, cy), bottom = mostOf(ay, by, cy);
        cellsBetween(left, right, width, p.x0[i], p.x1[i]);
        cellsBetween(top, bottom, height, p.y0[i], p.y1[i]);
        const float area = (bx - ax) * (cy - ay) - (by - ay) * (cx - ax);
        p.inverse_area[i] = 1.0F / area;
        const float deep = mostOf(az, bz, cz) - leastOf(az, bz, cz);
        const float wide = (right - left) * column, high = (bottom - top) * row;
        const float limit = kSteepest * area * column * row;
        const bool steep = deep * deep * (wide * wide + high * high) > limit * limit;
        p.x1[i] = steep ? -1 : p.x1[i];
    }
}

template <class Cover>
PEELER_INLINE void coverPatch(const Occluders& occluders, const OccluderPiece& piece,
                              const OccluderPatch& patch, const PatchView& view,
                              const CellReceivers& r) {
    PlacedTriangles p;
    placeTriangles(occluders, patch, view, r, p);
    const Cover cover(piece, r);
    for (std::uint32_t i = 0; i < patch.triangles; ++i) {
        const int x0 = p.x0[i], x1 = p.x1[i], y0 = p.y0[i], y1 = p.y1[i];
        if (x1 < x0 || y1 < y0) continue;
        const glm::vec2 a{p.a[0][i], p.a[1][i]}, b{p.b[0][i], p.b[1][i]}, c{p.c[0][i], p.c[1][i]};
        const float inverse = p.inverse_area[i];  // a non-finite triangle covers nothing
        FacingTriangle t;
        t.x = a.x;
        t.y = a.y;
        t.z = p.a[2][i];
        t.second_x = (c.y - a.y) * inverse;
        t.second_y = (a.x - c.x) * inverse;
        t.third_x = (a.y - b.y) * inverse;
        t.third_y = (b.x - a.x) * inverse;
        t.second_z = p.b[2][i] - t.z;
        t.third_z = p.c[2][i] - t.z;
        if constexpr (Cover::kNeedsSide) {
            // A receiver that looks along Z sees the front of a counter-clockwise triangle, or the
            // back if a reflection mirrors the triangle. A receiver that looks against Z sees the
            // other face.
            const bool front = (inverse > 0) != piece.mirrored;
            t.side = front == piece.cull_back ? 1.0F : -1.0F;
            t.element = patch.first_element + i;
        }
        if (y1 - y0 >= kPlainRows && x1 > x0) {
            coverRows(cover, t, a, b, c, x0, x1, y0, y1, r);
            continue;
        }
        const std::uint32_t* row = r.first + std::size_t(y0) * std::size_t(r.width);
        for (int y = y0; y <= y1; ++y, row += r.width)
            cover(t, row[x0], row[x1 + 1]);
    }
}

template <class Cover>
void coverAnywhere(const Occluders& occluders, const OccluderPiece& piece,
                   const OccluderPatch& patch, const PatchView& view, const CellReceivers& r) {
    coverPatch<Cover>(occluders, piece, patch, view, r);
}

#ifdef __x86_64__
template <class Cover>
[[gnu::target("avx2")]] void coverOnAvx2(const Occluders& occluders, const OccluderPiece& piece,
                                         const OccluderPatch& patch, const PatchView& view,
                                         const CellReceivers& r) {
    coverPatch<Cover>(occluders, piece, patch, view, r);
}
#endif

template <bool kOneSided>
CoverPatch laneCover([[maybe_unused]] bool for_every_processor) {
#ifdef __x86_64__
    if (hasAvx2() && !for_every_processor) return coverOnAvx2<LaneCover<EightLanes, kOneSided>>;
#endif
    return coverAnywhere<LaneCover<FourLanes, kOneSided>>;
}

}  // namespace

CoverPatch coverPatchFor(const OccluderPiece& piece, bool for_every_processor) {
    if (piece.alpha) return coverAnywhere<TestedCover>;
    return piece.cull_front || piece.cull_back ? laneCover<true>(for_every_processor)
                                               : laneCover<false>(for_every_processor);
}

}  // namespace peeler
