// SPDX-License-Identifier: Apache-2.0
#include "core/raster/scene_triangles.h"

#include <algorithm>
#include <cmath>
#include <limits>
#include <optional>

#include <peeler/error.h>
#include "core/base/parallel.h"
#include "core/raster/hit_depth.h"
#include "core/scene/elements.h"
#include "shaders/interface.glsl"

namespace peeler {
namespace {

// The maximum number of vertices in a batch. Only a single primitive may have more. The number is
// small enough to fit a core's cache, and large enough to justify two parallel loops.
constexpr std::size_t kBatchCorners = std::size_t{1} << 17;
constexpr std::size_t kCornersAtOnce = 4096;  // vertices to snap in one task

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
        piece.positions = &posed_.positions(geometry);
        piece.triangles = static_cast<std::uint32_t>(elementsOf(primitive));
        if (piece.triangles == 0) continue;
        piece.mirrored = draw.mirrored;
        piece.double_sided = scene.materials[draw.material].double_sided;
        if (draw.alpha_tested) {
            piece.alpha = &alpha_tests_.emplace_back(posed_, geometry);
            if (const Image* const image = piece.alpha->image())
                piece.ranges = &alpha_ranges_.try_emplace(image, *image).first->second;
        }
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
                    "trace parts of it: " + Parameter::kInclude + ", " + Parameter::kExclude);
    }
    blocks_ = number / HitTriangles::kBlock;
}

namespace {

/// Finds the rays of a section that hit one block of triangles. Stores rows a few hundred at a
/// time: a branch on empty rows, which are known only late, would stall the next triangle.
class BlockWalk {
  public:
    BlockWalk(const HitView& seen, const Window& section, SpanStore& store, SectionWriter& writer)
        : seen_(seen),
          store_(store),
          writer_(writer),
          window_{seen.grid.bits(), section.x0 + seen.grid.origin().x,
                  section.y0 + seen.grid.origin().y, section.x1 + seen.grid.origin().x,
                  section.y1 + seen.grid.origin().y} {}

    /// Begins a block. Called before its first piece.
    void begin(std::size_t block) {
        number_ = static_cast<std::uint32_t>(block) << HitTriangles::kBlockBits;
        triangles_ = writer_.room(store_.pool());
        room_ = triangles_ != nullptr;
        store_.triangles().place(block, triangles_);
    }
    /// Ends the block. Called after its last piece.
    void end() { writer_.keep(found_); }
    /// Returns false if memory has run out.
    bool hasRoom() const { return room_; }

    /// Processes triangles [first, last) of a piece. Their corners must be snapped.
    void walk(const TrianglePiece& piece, const SnappedCorner* corners, std::uint32_t first,
              std::uint32_t last);

  private:
    using Vertices = std::array<std::uint32_t, 3>;
    /// A triangle that may cover rays.
    struct Candidate {
        std::uint32_t element = 0;
        Vertices vertex{};  // vertex indices, sorted by position unless the triangle is clipped
    };
    /// A row of a candidate. It may be empty.
    struct Row {
        std::uint32_t candidate = 0;
        std::int32_t row = 0, first = 0, end = 0;
    };
    static constexpr std::size_t kRows = 512, kMostShortRows = 8;

    template <class CornersOf>
    void walkAll(std::uint32_t first, std::uint32_t last, CornersOf&& corners_of);
    void walkOne(std::uint32_t element, const Vertices& vertex);
    void walkCut(std::uint32_t element, const Vertices& vertex);
    void add(std::int32_t row, std::int32_t first, std::int32_t end) {
        if (rows_ == kRows) storeRows();
        row_[rows_] = {candidates_, row, first, end};
        rows_ += first < end ? 1U : 0U;
    }
    void storeRows();
    void beginTriangle(const Candidate& candidate);
    void storeSpan(std::int32_t row, std::int32_t first, std::int32_t end);
    void storeTested(const Row& row);
    bool culled(bool clockwise) const {
        // Front faces are counter-clockwise, unless mirrored.
        return clockwise != piece_->mirrored ? cull_back_ : cull_front_;
    }
    std::array<glm::vec3, 3> positionsOf(const Vertices& vertex) const {
        const auto& positions = *piece_->positions;
        return {positions[vertex[0]], positions[vertex[1]], positions[vertex[2]]};
    }

    const HitView& seen_;
    SpanStore& store_;
    SectionWriter& writer_;
    RayWindow window_;
    HitTriangle* triangles_ = nullptr;
    std::size_t found_ = 0;
    std::uint32_t number_ = 0;
    bool room_ = true;
    // The current piece.
    const TrianglePiece* piece_ = nullptr;
    const SnappedCorner* corners_ = nullptr;
    const CornerPlacement* placement_ = nullptr;
    bool cull_front_ = false, cull_back_ = false;
    // The last triangle that was stored: whether all of its rays pass, or none; else the test.
    std::optional<bool> passes_;
    std::optional<TriangleTest> test_;
    // Rows that have not been stored.
    std::array<Row, kRows + 1> row_;
    std::array<Candidate, kRows + 1> candidate_;
    std::size_t rows_ = 0;
    std::uint32_t candidates_ = 0, last_stored_ = kNone;
    static constexpr std::uint32_t kNone = 0xFFFFFFFF;
};

void BlockWalk::storeSpan(std::int32_t row, std::int32_t first, std::int32_t end) {
    room_ &= writer_.spans.add(store_.pool(), static_cast<std::size_t>(row - window_.y0),
                               {number_ + static_cast<std::uint32_t>(found_ - 1),
                                static_cast<std::uint16_t>(first - window_.x0),
                                static_cast<std::uint16_t>(end - 1 - window_.x0)});
}

void BlockWalk::storeTested(const Row& row) {
    std::int32_t begin = row.first;
    for (std::int32_t ray = row.first; ray <= row.end; ++ray) {
        const bool passes = ray < row.end && test_->passes(ray - seen_.grid.origin().x,
                                                           row.row - seen_.grid.origin().y);
        if (passes) continue;
        if (begin < ray) storeSpan(row.row, begin, ray);
        begin = ray + 1;
    }
}

/// Finds the plane of a triangle, and whether its rays need tests.
void BlockWalk::beginTriangle(const Candidate& candidate) {
    const std::array<glm::vec3, 3> positions = positionsOf(candidate.vertex);
    HitTriangle& triangle = triangles_[found_++];
    triangle = hitTriangle(*placement_, seen_, positions);
    triangle.key = piece_->first_key + candidate.element;
    const AlphaTest* alpha = piece_->alpha;
    passes_ = alpha ? alpha->passesEverywhere(candidate.vertex, piece_->ranges) : true;
    if (passes_ == true) alpha = nullptr;
    if (passes_ == true && seen_.cut && !isWithin(triangle, seen_.view.projection)) passes_ = {};
    if (!passes_) test_.emplace(seen_, *placement_, triangle, alpha, candidate.vertex, positions);
}

void BlockWalk::storeRows() {
    for (std::size_t i = 0; i < rows_ && room_; ++i) {
        const Row row = row_[i];
        if (row.candidate != last_stored_) {
            last_stored_ = row.candidate;
            beginTriangle(candidate_[row.candidate]);
        }
        if (passes_ == true)
            storeSpan(row.row, row.first, row.end);
        else if (!passes_)
            storeTested(row);
    }
    rows_ = 0;
    // Keeps the last candidate, which may have more rows.
    candidate_[0] = candidate_[candidates_];
    last_stored_ = last_stored_ == candidates_ ? 0 : kNone;
    candidates_ = 0;
}

void BlockWalk::walkOne(std::uint32_t element, const Vertices& vertex) {
    const SnappedCorner a = corners_[vertex[0]], b = corners_[vertex[1]], c = corners_[vertex[2]];
    if ((a.x | b.x | c.x) < 0) return walkCut(element, vertex);
    // Skips triangles that no ray meets because they lie between rays, like most triangles of fine
    // meshes.
    RayWindow window = window_;
    window.x0 = std::max(window.x0, window.rayFrom(std::min({a.x, b.x, c.x})));
    window.x1 = std::min(window.x1, window.rayFrom(std::max({a.x, b.x, c.x})));
    window.y0 = std::max(window.y0, window.rayFrom(std::min({a.y, b.y, c.y})));
    window.y1 = std::min(window.y1, window.rayFrom(std::max({a.y, b.y, c.y})));
    if (window.x0 >= window.x1 || window.y0 >= window.y1) return;
    const SortedTriangle triangle(a, b, c);
    if (triangle.area == 0 || culled(triangle.clockwise())) return;
    if (rows_ + kMostShortRows > kRows) storeRows();
    // Brings the corners into an order that does not depend on which corner is listed first. So
    // coincident triangles get the same depth.
    candidate_[++candidates_] = {
        element, {vertex[triangle.which[0]], vertex[triangle.which[1]], vertex[triangle.which[2]]}};
    forEachRow(triangle, window, [this](std::int32_t row, std::int32_t first, std::int32_t end) {
        add(row, first, end);
    });
}

/// Processes a triangle that extends beyond the grid or behind a pinhole.
void BlockWalk::walkCut(std::uint32_t element, const Vertices& vertex) {
    const PlacedPolygon polygon = placement_->placedPolygon(positionsOf(vertex));
    if (polygon.corners < 3) return;
    std::array<SnappedCorner, std::tuple_size_v<decltype(polygon.corner)>> corners;
    double area = 0;
    for (std::size_t i = 0; i < polygon.corners; ++i)
        corners[i] = snapped(polygon.corner[i]);
    for (std::size_t i = 2; i < polygon.corners; ++i)
        area += static_cast<double>(doubledArea(corners[0], corners[i - 1], corners[i]));
    if (culled(area > 0)) return;
    candidate_[++candidates_] = {element, vertex};
    forEachRow(
        std::span<const SnappedCorner>(corners.data(), polygon.corners), window_,
        [this](std::int32_t row, std::int32_t first, std::int32_t end) { add(row, first, end); });
}

template <class CornersOf>
void BlockWalk::walkAll(std::uint32_t first, std::uint32_t last, CornersOf&& corners_of) {
    for (std::uint32_t element = first; element < last && room_; ++element) {
        if (candidates_ == kRows) storeRows();
        walkOne(element, corners_of(element));
    }
}

void BlockWalk::walk(const TrianglePiece& piece, const SnappedCorner* corners, std::uint32_t first,
                     std::uint32_t last) {
    const CornerPlacement placement(seen_.view, seen_.grid, piece.world);
    piece_ = &piece;
    corners_ = corners;
    placement_ = &placement;
    cull_front_ = seen_.faces == Faces::kBack;
    cull_back_ =
        seen_.faces == Faces::kFront || (seen_.faces == Faces::kGltf && !piece.double_sided);
    candidates_ = 0;
    last_stored_ = kNone;
    const Primitive& primitive = *piece.primitive;
    const std::uint32_t* const indices = primitive.indices.data();
    if (primitive.topology != Topology::kTriangles) {
        walkAll(first, last, [&](std::uint32_t element) {
            const auto [a, b, c] = cornersOf(primitive, element).vertex;
            return Vertices{static_cast<std::uint32_t>(a), static_cast<std::uint32_t>(b),
                            static_cast<std::uint32_t>(c)};
        });
    } else if (primitive.indices.empty()) {
        walkAll(first, last, [](std::uint32_t element) {
            return Vertices{3 * element, 3 * element + 1, 3 * element + 2};
        });
    } else {
        walkAll(first, last, [indices](std::uint32_t element) {
            const std::size_t at = std::size_t{element} * 3;
            return Vertices{indices[at], indices[at + 1], indices[at + 2]};
        });
    }
    storeRows();
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
                walk.begin(block);
                for (std::size_t i = piece_at(&TrianglePiece::first, first);
                     i < pieces.size() && pieces[i].first < end && walk.hasRoom(); ++i) {
                    const TrianglePiece& piece = pieces[i];
                    const std::uint64_t from = std::max(first, piece.first) - piece.first;
                    const std::uint64_t to =
                        std::min<std::uint64_t>(end - piece.first, piece.triangles);
                    if (from >= to) continue;
                    walk.walk(piece, corners_.data() + piece.first_corner,
                              static_cast<std::uint32_t>(from), static_cast<std::uint32_t>(to));
                }
                walk.end();
                if (!walk.hasRoom()) store.overflow();
            });
        });
    }
}

}  // namespace peeler
