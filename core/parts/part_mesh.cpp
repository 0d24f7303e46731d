// SPDX-License-Identifier: Apache-2.0
#include "core/parts/part_mesh.h"

#include <algorithm>
#include <bit>
#include <functional>
#include <numeric>
#include <tuple>
#include <unordered_map>

#include "core/scene/elements.h"

namespace peeler {
namespace {

/// Welds equal positions into points, and numbers the points in order of appearance. Returns the
/// point of each position. Appends to `firsts`, for each point, the index of its first position.
template <class T>
std::vector<std::uint32_t> weldedPlaces(const std::vector<glm::vec<3, T>>& places,
                                        std::vector<std::uint32_t>& firsts) {
    using Bits = std::conditional_t<sizeof(T) == 4, std::uint32_t, std::uint64_t>;
    struct Place {
        std::array<Bits, 3> bits;
        std::uint32_t index;
    };
    std::vector<Place> sorted;
    sorted.reserve(places.size());
    const auto bits = [](T x) { return std::bit_cast<Bits>(x + T(0)); };  // −0 becomes 0
    for (const auto& p : places)
        sorted.push_back(
            {{bits(p.x), bits(p.y), bits(p.z)}, static_cast<std::uint32_t>(sorted.size())});
    std::sort(sorted.begin(), sorted.end(), [](const Place& a, const Place& b) {
        return std::tie(a.bits, a.index) < std::tie(b.bits, b.index);
    });
    std::vector<std::uint32_t> first_of(places.size()), number(places.size());
    for (std::size_t i = 0; i < sorted.size(); ++i) {
        const bool same = i > 0 && sorted[i].bits == sorted[i - 1].bits;
        first_of[sorted[i].index] = same ? first_of[sorted[i - 1].index] : sorted[i].index;
    }
    for (std::uint32_t i = 0; i < places.size(); ++i) {
        if (first_of[i] == i) {
            number[i] = static_cast<std::uint32_t>(firsts.size());
            firsts.push_back(i);
        } else {
            number[i] = number[first_of[i]];
        }
    }
    return number;
}

void addTriangle(PartMesh& mesh, const PartMesh::Triangle& t) {
    if (t[0] == t[1] || t[1] == t[2] || t[2] == t[0])
        ++mesh.degenerate;
    else
        mesh.triangles.push_back(t);
}

}  // namespace

int PartMesh::sharedCorners(std::size_t a, std::size_t b) const {
    int shared = 0;
    for (const std::uint32_t point : triangles[a])
        shared += std::ranges::count(triangles[b], point) > 0 ? 1 : 0;
    return shared;
}

Bounds PartMesh::bounds() const {
    if (points.empty()) return {};
    Bounds box{points.front(), points.front()};
    for (const glm::dvec3& p : points) {
        box.min = glm::min(box.min, p);
        box.max = glm::max(box.max, p);
    }
    return box;
}

double PartMesh::size() const {
    const Bounds box = bounds();
    return glm::length(box.max - box.min);
}

PartMesh partMesh(const PosedScene& posed, const MeshInstance& instance) {
    const auto& primitives = posed.primitives(instance);
    std::vector<glm::vec3> places;
    std::vector<std::size_t> first_places;
    for (std::size_t i = 0; i < primitives.size(); ++i) {
        first_places.push_back(places.size());
        if (primitives[i].topology < Topology::kTriangles) continue;
        const auto& positions = posed.positions(instance, i);
        places.insert(places.end(), positions.begin(), positions.end());
    }
    std::vector<std::uint32_t> firsts;
    const std::vector<std::uint32_t> point = weldedPlaces(places, firsts);
    PartMesh mesh;
    mesh.points.reserve(firsts.size());
    for (const std::uint32_t place : firsts)
        mesh.points.emplace_back(instance.world * glm::dvec4(glm::dvec3(places[place]), 1));
    for (std::size_t i = 0; i < primitives.size(); ++i) {
        if (primitives[i].topology < Topology::kTriangles) continue;
        const std::uint64_t elements = elementsOf(primitives[i]);
        for (std::uint64_t e = 0; e < elements; ++e) {
            const Corners corners = cornersOf(primitives[i], static_cast<std::uint32_t>(e));
            PartMesh::Triangle t{};
            for (std::size_t k = 0; k < 3; ++k)
                t[k] = point[first_places[i] + corners.vertex[k]];
            if (instance.mirrored) std::swap(t[1], t[2]);
            addTriangle(mesh, t);
        }
    }
    return mesh;
}

PartMesh joinParts(const std::vector<const PartMesh*>& parts, bool weld) {
    PartMesh all;
    std::vector<glm::dvec3> places;
    for (const PartMesh* part : parts)
        places.insert(places.end(), part->points.begin(), part->points.end());
    std::vector<std::uint32_t> point(places.size());
    if (weld) {
        std::vector<std::uint32_t> firsts;
        point = weldedPlaces(places, firsts);
        for (const std::uint32_t first : firsts)
            all.points.push_back(places[first]);
    } else {
        std::iota(point.begin(), point.end(), 0U);
        all.points = std::move(places);
    }
    std::size_t before = 0;
    for (const PartMesh* part : parts) {
        for (const PartMesh::Triangle& t : part->triangles)
            addTriangle(all, {point[before + t[0]], point[before + t[1]], point[before + t[2]]});
        all.degenerate += part->degenerate;
        before += part->points.size();
    }
    return all;
}

std::vector<std::uint32_t> pointsOf(const std::vector<PartEdge>& edges) {
    std::vector<std::uint32_t> points;
    for (const PartEdge& edge : edges)
        points.insert(points.end(), {edge.a, edge.b});
    std::sort(points.begin(), points.end());
    points.erase(std::unique(points.begin(), points.end()), points.end());
    return points;
}

namespace {

/// Points that are farther than a distance from each other, in cubic cells.
class SparsePoints {
  public:
    explicit SparsePoints(double apart) : apart_(apart), cell_(4 * apart) {}

    /// Returns the first point within the distance. If there is no such point, adds and returns
    /// `point`.
    std::uint32_t near(const glm::dvec3& p, std::uint32_t point) {
        const glm::dvec3 least = cellOf(p - apart_), most = cellOf(p + apart_);
        std::uint32_t found = kNone;
        // Along each axis, the interval from p - apart_ to p + apart_ is shorter than a cell. So it
        // lies in the cells of its two ends, and no other cells have points within the distance.
        for (const double x : {least.x, most.x})
            for (const double y : {least.y, most.y})
                for (const double z : {least.z, most.z})
                    found = std::min(found, nearIn({x, y, z}, p));
        if (found != kNone) return found;
        cells_.emplace(cellOf(p), std::pair(p, point));
        return point;
    }

  private:
    static constexpr std::uint32_t kNone = std::numeric_limits<std::uint32_t>::max();
    struct CellHash {
        std::size_t operator()(const glm::dvec3& cell) const {
            const std::hash<double> hash;
            return (hash(cell.x) * 31 + hash(cell.y)) * 31 + hash(cell.z);
        }
    };

    glm::dvec3 cellOf(const glm::dvec3& p) const { return glm::floor(p / cell_); }
    std::uint32_t nearIn(const glm::dvec3& cell, const glm::dvec3& p) const {
        std::uint32_t found = kNone;
        const auto [begin, end] = cells_.equal_range(cell);
        for (auto it = begin; it != end; ++it)
            if (glm::length(it->second.first - p) <= apart_)
                found = std::min(found, it->second.second);
        return found;
    }

    double apart_, cell_;
    std::unordered_multimap<glm::dvec3, std::pair<glm::dvec3, std::uint32_t>, CellHash> cells_;
};

}  // namespace

PartMesh weldPoints(const PartMesh& mesh, const std::vector<std::uint32_t>& candidates,
                    double tolerance) {
    std::vector<std::uint32_t> kept(mesh.points.size());
    std::iota(kept.begin(), kept.end(), 0U);
    SparsePoints sparse(tolerance);
    for (const std::uint32_t point : candidates)
        kept[point] = sparse.near(mesh.points[point], point);
    PartMesh welded;
    welded.degenerate = mesh.degenerate;
    std::vector<std::uint32_t> number(mesh.points.size());
    for (std::uint32_t point = 0; point < kept.size(); ++point) {
        if (kept[point] != point) continue;
        number[point] = static_cast<std::uint32_t>(welded.points.size());
        welded.points.push_back(mesh.points[point]);
    }
    for (const auto& [a, b, c] : mesh.triangles)
        addTriangle(welded, {number[kept[a]], number[kept[b]], number[kept[c]]});
    return welded;
}

namespace {

struct TriangleSide {
    PartEdge edge;
    std::uint32_t triangle = 0;
    std::uint8_t side = 0;
    bool forward = false;  ///< whether the triangle traverses the edge from a to b
};

std::vector<TriangleSide> sortedSides(const PartMesh& mesh) {
    std::vector<TriangleSide> sides;
    sides.reserve(3 * mesh.triangles.size());
    for (std::uint32_t t = 0; t < mesh.triangles.size(); ++t) {
        for (std::uint8_t i = 0; i < 3; ++i) {
            const std::uint32_t from = mesh.triangles[t][i], to = mesh.triangles[t][(i + 1U) % 3];
            sides.push_back({{std::min(from, to), std::max(from, to)}, t, i, from < to});
        }
    }
    std::sort(sides.begin(), sides.end(), [](const TriangleSide& x, const TriangleSide& y) {
        return std::tie(x.edge, x.triangle) < std::tie(y.edge, y.triangle);
    });
    return sides;
}

/// Returns the number of groups of edges that share points (union-find over the points).
std::uint64_t groupsOf(const std::vector<PartEdge>& edges) {
    const std::vector<std::uint32_t> points = pointsOf(edges);
    std::vector<std::size_t> parent(points.size());
    std::iota(parent.begin(), parent.end(), std::size_t{0});
    const auto root = [&](std::uint32_t point) {
        auto i = static_cast<std::size_t>(std::lower_bound(points.begin(), points.end(), point) -
                                          points.begin());
        while (parent[i] != i)
            i = parent[i] = parent[parent[i]];
        return i;
    };
    std::uint64_t groups = points.size();
    for (const PartEdge& edge : edges) {
        const std::size_t a = root(edge.a), b = root(edge.b);
        if (a == b) continue;
        parent[a] = b;
        --groups;
    }
    return groups;
}

/// A walk over triangles across shared edges. Finds the shells and, in each shell, the triangles
/// that face against the majority.
class ShellWalk {
  public:
    ShellWalk(const PartMesh& mesh, PartTopology& topology,
              const std::vector<std::array<bool, 3>>& against)
        : mesh_(mesh), topology_(topology), against_(against), turned_(mesh.triangles.size()) {
        topology_.shell_of.assign(mesh.triangles.size(), kNoTriangle);
    }

    void run() {
        for (std::uint32_t t = 0; t < mesh_.triangles.size(); ++t)
            if (topology_.shell_of[t] == kNoTriangle) walk(t);
        std::sort(topology_.turned.begin(), topology_.turned.end());
    }

  private:
    void walk(std::uint32_t seed) {
        const auto number = static_cast<std::uint32_t>(topology_.shells.size());
        PartShell shell;
        found_.assign(1, seed);
        topology_.shell_of[seed] = number;
        for (std::size_t i = 0; i < found_.size(); ++i)
            visit(found_[i], number, shell);
        finish(shell);
        topology_.shells.push_back(shell);
    }

    void visit(std::uint32_t t, std::uint32_t number, PartShell& shell) {
        for (std::size_t side = 0; side < 3; ++side) {
            const std::uint32_t other = topology_.beyond[t][side];
            if (other == kNoTriangle) continue;
            const bool turned = turned_[t] != against_[t][side];
            if (topology_.shell_of[other] == kNoTriangle) {
                topology_.shell_of[other] = number;
                turned_[other] = turned;
                found_.push_back(other);
            } else if (turned_[other] != turned) {
                shell.orientable = false;
            }
        }
    }

    void finish(PartShell& shell) {
        const auto count = static_cast<std::size_t>(
            std::ranges::count_if(found_, [&](std::uint32_t t) { return turned_[t]; }));
        const bool most = 2 * count > found_.size();
        const glm::dvec3 origin = mesh_.points[mesh_.triangles[found_.front()][0]];
        double largest = -1;
        for (const std::uint32_t t : found_) {
            const bool turned = turned_[t] != most;
            if (turned) topology_.turned.push_back(t);
            const auto [a, b, c] = mesh_.corners(t);
            const double six = glm::dot(a - origin, glm::cross(b - origin, c - origin));
            shell.volume += (turned ? -six : six) / 6;
            const double area = glm::length(mesh_.normal(t)) / 2;
            shell.area += area;
            if (area <= largest) continue;
            largest = area;
            shell.first = t;
        }
        shell.triangles = found_.size();
    }

    const PartMesh& mesh_;
    PartTopology& topology_;
    const std::vector<std::array<bool, 3>>& against_;
    std::vector<char> turned_;
    std::vector<std::uint32_t> found_;
};

}  // namespace

PartTopology findTopology(const PartMesh& mesh) {
    PartTopology topology;
    topology.beyond.assign(mesh.triangles.size(), {kNoTriangle, kNoTriangle, kNoTriangle});
    std::vector<std::array<bool, 3>> against(mesh.triangles.size());
    const std::vector<TriangleSide> sides = sortedSides(mesh);
    std::vector<std::uint32_t> open_triangles;
    for (std::size_t i = 0, end = 0; i < sides.size(); i = end) {
        while (end < sides.size() && sides[end].edge == sides[i].edge)
            ++end;
        const std::size_t count = end - i;
        if (count % 2 == 1) {
            topology.open.push_back(sides[i].edge);
            for (std::size_t k = i; k < end; ++k)
                open_triangles.push_back(sides[k].triangle);
        }
        if (count > 2) topology.crowded.push_back(sides[i].edge);
        if (count != 2) continue;
        const TriangleSide &x = sides[i], &y = sides[i + 1];
        topology.beyond[x.triangle][x.side] = y.triangle;
        topology.beyond[y.triangle][y.side] = x.triangle;
        if (x.forward != y.forward) continue;
        against[x.triangle][x.side] = against[y.triangle][y.side] = true;
    }
    topology.holes = groupsOf(topology.open);
    ShellWalk(mesh, topology, against).run();
    for (const std::uint32_t t : open_triangles)
        ++topology.shells[topology.shell_of[t]].open_edges;
    return topology;
}

}  // namespace peeler
