// SPDX-License-Identifier: Apache-2.0
#include "core/raster/scene_triangles.h"

#include <algorithm>
#include <cmath>
#include <limits>

#include "core/base/error.h"
#include "core/base/parallel.h"
#include "core/raster/hit_depth.h"
#include "core/scene/elements.h"
#include "shaders/interface.glsl"

namespace peeler {
namespace {

// Vertices of a batch, unless a single primitive has more: what stays in a core's cache, and is
// worth two loops over all threads.
constexpr std::size_t kBatchCorners = std::size_t{1} << 17;
constexpr std::size_t kCornersAtOnce = 4096;  // that a thread snaps

}  // namespace

SceneTriangles::SceneTriangles(const PosedScene& posed) : posed_(posed) {
    const DrawList& list = posed_.drawList();
    const Scene& scene = posed_.scene();
    alpha_tests_.reserve(list.draws().size());
    std::uint64_t number = 0;
    const auto close_batch = [&] {
        if (batches_.empty()) return;
        Batch& batch = batches_.back();
        batch.pieces = pieces_.size() - batch.first_piece;
        const std::uint64_t end = (number + HitTriangles::kBlock - 1) / HitTriangles::kBlock;
        batch.blocks = end - batch.first_block;
        number = end * HitTriangles::kBlock;
        most_corners_ = std::max(most_corners_, batch.corners);
    };
    for (const Draw& draw : list.draws()) {
        if ((draw.flags & PEELER_IS_TRIANGLES) == 0) continue;
        const Geometry& geometry = list.geometries()[draw.geometry];
        const Primitive& primitive =
            scene.meshes[static_cast<std::size_t>(geometry.mesh)].primitives[geometry.primitive];
        TrianglePiece piece;
        piece.primitive = &primitive;
        piece.positions =
            geometry.deformed < 0
                ? &primitive.positions
                : &posed_
                       .deformed()[static_cast<std::size_t>(geometry.deformed)][geometry.primitive]
                       .positions;
        piece.triangles = static_cast<std::uint32_t>(elementsOf(primitive));
        if (piece.triangles == 0) continue;
        piece.mirrored = draw.mirrored;
        piece.double_sided = scene.materials[draw.material].double_sided;
        if (draw.alpha_tested) piece.alpha = &alpha_tests_.emplace_back(scene, primitive);
        for (std::size_t i = 0; i < draw.instances; ++i) {
            if (batches_.empty() ||
                batches_.back().corners + piece.positions->size() > kBatchCorners) {
                close_batch();
                batches_.push_back({pieces_.size(), 0, 0, number / HitTriangles::kBlock, 0});
            }
            piece.world = list.worlds(draw)[i];
            piece.first_key =
                draw.first_primitive + static_cast<std::uint32_t>(i) * draw.instance_keys;
            piece.first = number;
            piece.first_corner = batches_.back().corners;
            pieces_.push_back(piece);
            batches_.back().corners += piece.positions->size();
            number += piece.triangles;
        }
    }
    close_batch();
    if (number > std::numeric_limits<std::uint32_t>::max()) {
        throw Error(ErrorKind::kInput, "the scene has more triangles than 32 bits can count", "",
                    "trace it in parts");
    }
    blocks_ = number / HitTriangles::kBlock;
}

namespace {

/// Finds what the rays of a section hit of one block of triangles.
class BlockWalk {
  public:
    BlockWalk(const HitView& seen, const Window& section, SpanStore& store, SectionWriter& writer)
        : seen_(seen),
          section_(section),
          store_(store),
          writer_(writer),
          window_{seen.grid.bits(), section.x0 + seen.grid.origin().x,
                  section.y0 + seen.grid.origin().y, section.x1 + seen.grid.origin().x,
                  section.y1 + seen.grid.origin().y} {}

    /// False if there is no more memory.
    bool begin(std::size_t block) {
        number_ = static_cast<std::uint32_t>(block) << HitTriangles::kBlockBits;
        triangles_ = writer_.room(store_.pool());
        if (triangles_) store_.triangles().place(block, triangles_);
        return triangles_ != nullptr;
    }
    void end() { writer_.keep(found_); }

    /// The triangles of a piece from one to another, whose corners are snapped.
    bool walk(const TrianglePiece& piece, const SnappedCorner* corners, std::uint32_t first,
              std::uint32_t last);

  private:
    template <class CornersOf>
    bool walkAll(std::uint32_t first, std::uint32_t last, CornersOf&& corners_of);
    bool walkOne(std::uint32_t element, const std::array<std::size_t, 3>& vertex);
    bool walkCut(std::uint32_t element, const std::array<std::size_t, 3>& vertex);
    bool culled(bool clockwise) const {
        // Counter-clockwise is the front, unless a reflection has turned it.
        return clockwise != piece_->mirrored ? cull_back_ : cull_front_;
    }
    std::array<glm::vec3, 3> positionsOf(const std::array<std::size_t, 3>& vertex) const {
        const auto& positions = *piece_->positions;
        return {positions[vertex[0]], positions[vertex[1]], positions[vertex[2]]};
    }
    /// Takes the spans of a triangle, or of a polygon that was cut out of it.
    template <class Rows>
    bool keep(std::uint32_t element, const std::array<std::size_t, 3>& vertex,
              const std::array<std::size_t, 3>& order, Rows&& rows);

    const HitView& seen_;
    const Window& section_;
    SpanStore& store_;
    SectionWriter& writer_;
    RayWindow window_;
    HitTriangle* triangles_ = nullptr;
    std::size_t found_ = 0;
    std::uint32_t number_ = 0;
    // Of the piece at hand.
    const TrianglePiece* piece_ = nullptr;
    const SnappedCorner* corners_ = nullptr;
    const CornerPlacement* placement_ = nullptr;
    bool cull_front_ = false, cull_back_ = false;
};

template <class Rows>
bool BlockWalk::keep(std::uint32_t element, const std::array<std::size_t, 3>& vertex,
                     const std::array<std::size_t, 3>& order, Rows&& rows) {
    HitTriangle& triangle = triangles_[found_];
    const auto number = number_ + static_cast<std::uint32_t>(found_);
    bool placed = false, tested = false, room = true, hit = false;
    const auto add = [&](std::int32_t row, std::int32_t first, std::int32_t end) {
        hit = true;
        room &= writer_.spans.add(store_.pool(), static_cast<std::size_t>(row - window_.y0),
                                  {number, static_cast<std::uint16_t>(first - window_.x0),
                                   static_cast<std::uint16_t>(end - 1 - window_.x0)});
    };
    rows([&](std::int32_t row, std::int32_t first, std::int32_t end) {
        if (!placed) {
            placed = true;
            triangle = hitTriangle(*placement_, seen_, positionsOf(order));
            triangle.key = piece_->first_key + element;
            tested = piece_->alpha || (seen_.cut && !isWithin(triangle, seen_.view.projection));
        }
        if (!tested) return add(row, first, end);
        const TriangleTest test(seen_, *placement_, triangle, piece_->alpha, vertex,
                                positionsOf(vertex));
        std::int32_t begin = first;
        for (std::int32_t ray = first; ray <= end; ++ray) {
            const bool passes =
                ray < end && test.passes(ray - seen_.grid.origin().x, row - seen_.grid.origin().y);
            if (passes) continue;
            if (begin < ray) add(row, begin, ray);
            begin = ray + 1;
        }
    });
    found_ += hit ? 1 : 0;
    return room;
}

bool BlockWalk::walkOne(std::uint32_t element, const std::array<std::size_t, 3>& vertex) {
    const SnappedCorner a = corners_[vertex[0]], b = corners_[vertex[1]], c = corners_[vertex[2]];
    if ((a.x | b.x | c.x) < 0) return walkCut(element, vertex);
    const std::int32_t top = window_.rayFrom(std::min({a.y, b.y, c.y}));
    const std::int32_t bottom = window_.rayFrom(std::max({a.y, b.y, c.y}));
    const std::int32_t left = window_.rayFrom(std::min({a.x, b.x, c.x}));
    const std::int32_t right = window_.rayFrom(std::max({a.x, b.x, c.x}));
    if (std::max(top, window_.y0) >= std::min(bottom, window_.y1) ||
        std::max(left, window_.x0) >= std::min(right, window_.x1))
        return true;
    const std::int64_t area = doubledArea(a, b, c);
    if (area == 0 || culled(area > 0)) return true;
    // In an order that does not depend on which corner comes first, so that of triangles that
    // coincide depths do so, too.
    std::array<std::size_t, 3> order = vertex;
    const auto sort = [&](std::size_t i, std::size_t k) {
        const SnappedCorner& one = corners_[order[i]];
        const SnappedCorner& other = corners_[order[k]];
        if (other.y < one.y || (other.y == one.y && other.x < one.x)) std::swap(order[i], order[k]);
    };
    sort(0, 1);
    sort(1, 2);
    sort(0, 1);
    return keep(element, vertex, order, [&](auto&& emit) {
        forEachRow(corners_[order[0]], corners_[order[1]], corners_[order[2]], window_, emit);
    });
}

/// Of a triangle that leaves the grid or reaches behind a pinhole.
bool BlockWalk::walkCut(std::uint32_t element, const std::array<std::size_t, 3>& vertex) {
    const PlacedPolygon polygon = placement_->placedPolygon(positionsOf(vertex));
    if (polygon.corners < 3) return true;
    std::array<SnappedCorner, std::tuple_size_v<decltype(polygon.corner)>> corners;
    double area = 0;
    for (std::size_t i = 0; i < polygon.corners; ++i)
        corners[i] = snapped(polygon.corner[i]);
    for (std::size_t i = 2; i < polygon.corners; ++i)
        area += static_cast<double>(doubledArea(corners[0], corners[i - 1], corners[i]));
    if (culled(area > 0)) return true;
    return keep(element, vertex, vertex, [&](auto&& emit) {
        forEachRow(std::span<const SnappedCorner>(corners.data(), polygon.corners), window_, emit);
    });
}

template <class CornersOf>
bool BlockWalk::walkAll(std::uint32_t first, std::uint32_t last, CornersOf&& corners_of) {
    for (std::uint32_t element = first; element < last; ++element)
        if (!walkOne(element, corners_of(element))) return false;
    return true;
}

bool BlockWalk::walk(const TrianglePiece& piece, const SnappedCorner* corners, std::uint32_t first,
                     std::uint32_t last) {
    using Vertices = std::array<std::size_t, 3>;
    const CornerPlacement placement(seen_.view, seen_.grid, piece.world);
    piece_ = &piece;
    corners_ = corners;
    placement_ = &placement;
    cull_front_ = seen_.faces == Faces::kBack;
    cull_back_ =
        seen_.faces == Faces::kFront || (seen_.faces == Faces::kGltf && !piece.double_sided);
    const Primitive& primitive = *piece.primitive;
    if (primitive.topology != Topology::kTriangles) {
        return walkAll(first, last,
                       [&](std::uint32_t element) { return cornersOf(primitive, element).vertex; });
    }
    if (primitive.indices.empty()) {
        return walkAll(first, last, [](std::uint32_t element) {
            const std::size_t at = std::size_t{element} * 3;
            return Vertices{at, at + 1, at + 2};
        });
    }
    const std::uint32_t* const indices = primitive.indices.data();
    return walkAll(first, last, [indices](std::uint32_t element) {
        const std::size_t at = std::size_t{element} * 3;
        return Vertices{indices[at], indices[at + 1], indices[at + 2]};
    });
}

}  // namespace

void SceneTriangles::findSpans(const HitView& seen, const Window& section, std::uint64_t limit,
                               SpanStore& store) {
    store.begin(static_cast<std::size_t>(section.height()), blocks_, limit);
    for (const Batch& batch : batches_) {
        if (store.overflowed()) return;
        const std::span<const TrianglePiece> pieces(pieces_.data() + batch.first_piece,
                                                    batch.pieces);
        if (corners_.size() < batch.corners) corners_.resize(batch.corners);
        const auto piece_at = [&](auto member, std::size_t at) {
            const auto after = std::upper_bound(pieces.begin(), pieces.end(), at,
                                                [&](std::size_t place, const TrianglePiece& piece) {
                                                    return place < piece.*member;
                                                });
            return static_cast<std::size_t>(after - pieces.begin()) - 1;
        };
        parallelFor((batch.corners + kCornersAtOnce - 1) / kCornersAtOnce, [&](std::size_t part) {
            const std::size_t end = std::min(batch.corners, (part + 1) * kCornersAtOnce);
            std::size_t at = part * kCornersAtOnce;
            for (std::size_t i = piece_at(&TrianglePiece::first_corner, at); at < end; ++i) {
                const TrianglePiece& piece = pieces[i];
                const std::size_t first = at - piece.first_corner;
                const std::size_t count = std::min(end - at, piece.positions->size() - first);
                const CornerPlacement placement(seen.view, seen.grid, piece.world);
                placement.snap({piece.positions->data() + first, count}, corners_.data() + at);
                at += count;
            }
        });
        parallelFor(batch.blocks, [&](std::size_t part) {
            if (store.overflowed()) return;
            const std::size_t block = batch.first_block + part;
            const std::uint64_t first = std::uint64_t{block} * HitTriangles::kBlock;
            const std::uint64_t end = first + HitTriangles::kBlock;
            store.write([&](SectionWriter& writer) {
                BlockWalk walk(seen, section, store, writer);
                bool room = walk.begin(block);
                for (std::size_t i = piece_at(&TrianglePiece::first, first);
                     room && i < pieces.size() && pieces[i].first < end; ++i) {
                    const TrianglePiece& piece = pieces[i];
                    const std::uint64_t from = std::max(first, piece.first) - piece.first;
                    const std::uint64_t to =
                        std::min<std::uint64_t>(end - piece.first, piece.triangles);
                    if (from >= to) continue;
                    room =
                        walk.walk(piece, corners_.data() + piece.first_corner,
                                  static_cast<std::uint32_t>(from), static_cast<std::uint32_t>(to));
                }
                walk.end();
                if (!room) store.overflow();
            });
        });
    }
}

}  // namespace peeler
