// SPDX-License-Identifier: Apache-2.0
#include "core/trace/ray_tracer.h"

#include <algorithm>
#include <cmath>
#include <iterator>
#include <limits>
#include <numeric>
#include <utility>

#include <peeler/error.h>
#include "core/base/parallel.h"
#include "core/scene/elements.h"
#include "shaders/interface.glsl"

namespace peeler {
namespace {

constexpr std::size_t kVerticesAtOnce = 8192;

bool isFinite(const glm::dvec3& point) {
    // Larger coordinates could overflow.
    constexpr double kMost = 0x1p900;
    return std::abs(point.x) < kMost && std::abs(point.y) < kMost && std::abs(point.z) < kMost;
}

glm::dvec3 worldPoint(const glm::dmat4& world, const glm::vec3& position) {
    return glm::dvec3(world * glm::dvec4(position, 1));
}

bool isFlat(const CellCorners& corners) {
    const auto normal = crossOf(corners[1] - corners[0], corners[2] - corners[0]);
    return normal[0] == 0 && normal[1] == 0 && normal[2] == 0;
}

}  // namespace

RayTracer::RayTracer(PosedScene posed) : posed_(std::move(posed)) {
    constexpr std::uint64_t kMost = std::uint64_t{1} << 31;
    constexpr double kInfinity = std::numeric_limits<double>::infinity();
    const DrawList& list = posed_.drawList();
    /// The vertices of an instance.
    struct Placed {
        const std::vector<glm::vec3>* positions;
        glm::dmat4 world;
        std::size_t first;
    };
    std::vector<Placed> placed;
    std::vector<std::uint32_t> first_keys;
    alpha_tests_.reserve(list.draws().size());
    std::uint64_t vertices = 0, triangles = 0, keys = 0;
    for (const Draw& draw : list.draws()) {
        if ((draw.flags & PEELER_IS_TRIANGLES) == 0) continue;
        const Geometry& geometry = list.geometries()[draw.geometry];
        Piece piece;
        piece.primitive = &posed_.scene()
                               .meshes[static_cast<std::size_t>(geometry.mesh)]
                               .primitives[geometry.primitive];
        piece.mirrored = draw.mirrored;
        piece.double_sided = posed_.scene().materials[draw.material].double_sided;
        const std::uint64_t elements = elementsOf(*piece.primitive);
        if (elements == 0) continue;
        if (draw.alpha_tested) piece.alpha = &alpha_tests_.emplace_back(posed_, geometry);
        for (std::size_t i = 0; i < draw.instances; ++i) {
            piece.first_key =
                draw.first_primitive + static_cast<std::uint32_t>(i) * draw.instance_keys;
            const auto& positions = posed_.positions(geometry);
            placed.push_back({&positions, list.worlds(draw)[i], vertices});
            pieces_.push_back(piece);
            first_keys.push_back(piece.first_key);
            keys = std::uint64_t{piece.first_key} + elements;
            vertices += positions.size();
            triangles += elements;
        }
    }
    if (vertices >= kMost || triangles >= kMost) {
        throw Error(ErrorKind::kInput, "the scene has more triangles or vertices than 2^31", "",
                    "trace parts of it: " + Parameter::kInclude + ", " + Parameter::kExclude);
    }
    piece_of_ = KeyIndex(std::move(first_keys), keys);

    std::vector<Bounds> bounds(placed.size(), {glm::dvec3(kInfinity), glm::dvec3(-kInfinity)});
    parallelFor(placed.size(), [&](std::size_t i) {
        for (const glm::vec3& position : *placed[i].positions) {
            const glm::dvec3 point = worldPoint(placed[i].world, position);
            if (!isFinite(point)) continue;
            bounds[i].min = glm::min(bounds[i].min, point);
            bounds[i].max = glm::max(bounds[i].max, point);
        }
    });
    Bounds box{glm::dvec3(kInfinity), glm::dvec3(-kInfinity)};
    for (const Bounds& part : bounds) {
        box.min = glm::min(box.min, part.min);
        box.max = glm::max(box.max, part.max);
    }
    if (!(box.min.x <= box.max.x)) return;  // there are no vertices
    grid_ = CellGrid(box);

    // The x of a vertex that is not finite.
    constexpr std::int64_t kNowhere = std::numeric_limits<std::int64_t>::max();
    vertices_.resize(vertices);
    for (const Placed& part : placed) {
        const std::size_t size = part.positions->size();
        parallelFor((size + kVerticesAtOnce - 1) / kVerticesAtOnce, [&](std::size_t task) {
            const std::size_t end = std::min(size, (task + 1) * kVerticesAtOnce);
            for (std::size_t i = task * kVerticesAtOnce; i < end; ++i) {
                const glm::dvec3 point = worldPoint(part.world, (*part.positions)[i]);
                vertices_[part.first + i] =
                    isFinite(point) ? rounded(grid_.position(point)) : Cells{kNowhere, 0, 0};
            }
        });
    }
    triangles_.reserve(triangles);
    for (std::size_t i = 0; i < placed.size(); ++i) {
        const Primitive& primitive = *pieces_[i].primitive;
        const auto elements = static_cast<std::uint32_t>(elementsOf(primitive));
        for (std::uint32_t element = 0; element < elements; ++element) {
            const Corners corners = peeler::cornersOf(primitive, element);
            Triangle triangle;
            triangle.key = pieces_[i].first_key + element;
            bool finite = true;
            for (std::size_t k = 0; k < 3; ++k) {
                const std::size_t vertex = placed[i].first + corners.vertex[k];
                triangle.vertex[k] = static_cast<std::uint32_t>(vertex);
                finite = finite && vertices_[vertex][0] != kNowhere;
            }
            // No ray hits a flat triangle (exactHit()).
            if (finite && !isFlat(cornersOf(triangle))) triangles_.push_back(triangle);
        }
    }
    tree_ = TriangleTree(triangles_.size(),
                         [this](std::uint32_t i) { return cornersOf(triangles_[i]); });
}

std::uint64_t RayTracer::mostBytes(const PosedScene& posed) {
    // Measured for a triangle: its corners, its box while the tree is built, and its part of the
    // tree.
    constexpr std::uint64_t kTriangleBytes = 160;
    std::uint64_t bytes = 0;
    for (const MeshInstance& instance : posed.meshes())
        for (std::size_t i = 0; i < posed.primitives(instance).size(); ++i) {
            const Primitive& primitive = posed.primitives(instance)[i];
            bytes +=
                kTriangleBytes * elementsOf(primitive) + sizeof(Cells) * primitive.positions.size();
        }
    return bytes;
}

/// A hit of a ray of a group.
struct RayTracer::GroupHit {
    std::uint32_t ray = 0;
    SortedHit hit = 0;
};

/// The working storage of a task, and the hits of a group of rays.
struct RayTracer::Scratch {
    std::vector<std::optional<ExactRay>> exact;
    RayPacket packet;
    std::vector<Candidate> candidates;
    std::vector<BlockPart> in_cone;
    std::vector<PacketCandidate> packet_candidates;
    std::vector<RayPacket::Hit> packet_hits;
    std::vector<GroupHit> found;
};

/// Applies the settings and the rules of culling and of alpha to an intersection.
bool RayTracer::isHit(const Piece& piece, const ExactRay& ray, const Triangle& triangle,
                      const ExactHit& hit, const TraceSettings& settings) const {
    if (double{hit.t} < settings.near || !(double{hit.t} < settings.far)) return false;
    const Faces faces = settings.faces;
    if (faces != Faces::kBoth && !(faces == Faces::kGltf && piece.double_sided)) {
        const bool shows_back = hit.back != piece.mirrored;
        if (shows_back != (faces == Faces::kBack)) return false;
    }
    if (!piece.alpha) return true;
    const Corners of = peeler::cornersOf(*piece.primitive, triangle.key - piece.first_key);
    return piece.alpha->passes(
        {static_cast<std::uint32_t>(of.vertex[0]), static_cast<std::uint32_t>(of.vertex[1]),
         static_cast<std::uint32_t>(of.vertex[2])},
        exactWeights(ray, cornersOf(triangle)));
}

/// Traces a ray of the group.
void RayTracer::traceRay(std::size_t index, const TraceSettings& settings, Scratch& scratch) const {
    if (!scratch.exact[index]) return;
    const ExactRay& ray = *scratch.exact[index];
    tree_.candidates(ray, scratch.candidates);
    for (const Candidate& candidate : scratch.candidates) {
        const Triangle& triangle = triangles_[candidate.triangle];
        const auto hit = exactHit(ray, cornersOf(triangle), candidate.inside);
        if (hit && isHit(pieceOf(triangle), ray, triangle, *hit, settings))
            scratch.found.push_back(
                {static_cast<std::uint32_t>(index), sortedHit(hit->t, triangle.key)});
    }
}

/// Traces the rays of the packet together, the first of which is this ray of the group. Returns
/// false if rays are faster one by one.
bool RayTracer::tracePacket(std::size_t first, const TraceSettings& settings,
                            Scratch& scratch) const {
    constexpr std::size_t kMostBlocks = 256;
    const RayPacket& packet = scratch.packet;
    if (!tree_.candidates(packet.cone(), kMostBlocks, scratch.in_cone)) return false;
    packet.candidates(scratch.in_cone, scratch.packet_candidates);
    for (const PacketCandidate& candidate : scratch.packet_candidates) {
        const Triangle& triangle = triangles_[candidate.triangle];
        const Piece& piece = pieceOf(triangle);
        packet.findHits(cornersOf(triangle), candidate, scratch.packet_hits);
        for (const RayPacket::Hit& hit : scratch.packet_hits) {
            const std::size_t ray = first + hit.ray;
            if (isHit(piece, *scratch.exact[ray], triangle, {hit.t, hit.back}, settings))
                scratch.found.push_back(
                    {static_cast<std::uint32_t>(ray), sortedHit(hit.t, triangle.key)});
        }
    }
    return true;
}

void RayTracer::traceGroup(std::span<const Ray> rays, const TraceSettings& settings,
                           Scratch& scratch, HitList& all) const {
    constexpr std::size_t kFewRays = 6;  // are faster one by one
    scratch.exact.clear();
    scratch.found.clear();
    for (const Ray& ray : rays)
        scratch.exact.push_back(ExactRay::make(grid_, ray.origin, ray.direction));
    for (std::size_t first = 0; first < rays.size();) {
        const std::size_t close =
            scratch.packet.take(std::span(std::as_const(scratch.exact)).subspan(first));
        const std::size_t end = first + std::max(close, std::size_t{1});
        if (close <= kFewRays || !tracePacket(first, settings, scratch)) {
            for (; first < end; ++first)
                traceRay(first, settings, scratch);
        }
        first = end;
    }
    addSorted(rays.size(), scratch, all);
}

/// Appends the hits of a group's rays, in order.
void RayTracer::addSorted(std::size_t rays, Scratch& scratch, HitList& all) {
    std::array<std::uint32_t, RayPacket::kMost> ends{};
    for (const GroupHit& hit : scratch.found)
        ++ends[hit.ray];
    all.counts.insert(all.counts.end(), ends.begin(), ends.begin() + rays);
    std::exclusive_scan(ends.begin(), ends.end(), ends.begin(), 0U);
    const std::size_t before = all.hits.size();
    all.hits.resize(before + scratch.found.size());
    const std::span sorted = std::span(all.hits).subspan(before);
    for (const GroupHit& hit : scratch.found)
        sorted[ends[hit.ray]++] = hit.hit;
    std::size_t first = 0;
    for (std::size_t i = 0; i < rays; ++i) {
        std::ranges::sort(sorted.subspan(first, ends[i] - first));
        first = ends[i];
    }
}

void RayTracer::trace(std::span<const Ray> rays, const TraceSettings& settings,
                      std::vector<HitList>& parts) const {
    parts.resize((rays.size() + kRaysOfPart - 1) / kRaysOfPart);
    ObjectPool<Scratch> scratches;
    parallelFor(parts.size(), [&](std::size_t task) {
        HitList& part = parts[task];
        part.counts.clear();
        part.hits.clear();
        const std::size_t end = std::min(rays.size(), (task + 1) * kRaysOfPart);
        scratches.with([&](Scratch& scratch) {
            for (std::size_t i = task * kRaysOfPart; i < end; i += RayPacket::kMost)
                traceGroup(rays.subspan(i, std::min(RayPacket::kMost, end - i)), settings, scratch,
                           part);
        });
    });
}

void RayTracer::trace(std::span<const Ray> rays, const TraceSettings& settings,
                      RayHits& hits) const {
    std::vector<HitList> parts;
    trace(rays, settings, parts);
    hits.offsets.assign(1, 0);
    hits.t.clear();
    hits.keys.clear();
    for (const HitList& part : parts) {
        for (const std::uint32_t count : part.counts)
            hits.offsets.push_back(hits.offsets.back() + count);
        std::ranges::transform(part.hits, std::back_inserter(hits.t), tOf);
        std::ranges::transform(part.hits, std::back_inserter(hits.keys), keyOf);
    }
}

std::array<double, 3> RayTracer::weightsAt(const Ray& ray, std::uint32_t key) const {
    const auto exact = ExactRay::make(grid_, ray.origin, ray.direction);
    const auto found = std::lower_bound(
        triangles_.begin(), triangles_.end(), key,
        [](const Triangle& triangle, std::uint32_t k) { return triangle.key < k; });
    if (!exact || found == triangles_.end() || found->key != key)
        throw Error(ErrorKind::kInternal, "the ray does not hit this triangle");
    return exactWeights(*exact, cornersOf(*found));
}

}  // namespace peeler
