// SPDX-License-Identifier: Apache-2.0
#include "core/rays/solids.h"

#include <algorithm>
#include <array>
#include <bit>
#include <cmath>
#include <optional>
#include <tuple>

#include "core/base/parallel.h"
#include "core/scene/elements.h"

namespace peeler {
namespace {

// Numbers of two welded vertices, the smaller first.
using Edge = std::pair<std::uint32_t, std::uint32_t>;

/// The finaliser of splitmix64 (Steele, Lea and Flood 2014).
std::uint64_t mixed(std::uint64_t hash) {
    hash = (hash ^ hash >> 30) * 0xBF58476D1CE4E5B9U;
    hash = (hash ^ hash >> 27) * 0x94D049BB133111EBU;
    return hash ^ hash >> 31;
}

/// The vertices of all primitives of a mesh, welded by position.
class WeldedMesh {
  public:
    WeldedMesh(const PosedScene& posed, const MeshInstance& instance) {
        const auto& primitives = posed.primitives(instance);
        std::size_t vertices = 0;
        for (std::size_t i = 0; i < primitives.size(); ++i) {
            first_.push_back(vertices);
            if (primitives[i].topology >= Topology::kTriangles)
                vertices += posed.positions(instance, i).size();
        }
        welded_.reserve(vertices);
        // A hash table with linear probing, at most half full. An entry is a vertex, plus 1.
        std::vector<std::uint32_t> table(std::bit_ceil(2 * vertices + 1));
        std::vector<std::array<std::uint32_t, 3>> bits;
        bits.reserve(vertices);
        for (std::size_t i = 0; i < primitives.size(); ++i) {
            if (primitives[i].topology < Topology::kTriangles) continue;
            for (const glm::vec3& p : posed.positions(instance, i)) {
                bits.push_back(bitsOf(p));
                std::size_t at = hashOf(bits.back());
                for (;; ++at) {
                    std::uint32_t& entry = table[at & (table.size() - 1)];
                    if (entry == 0) entry = static_cast<std::uint32_t>(bits.size());
                    if (bits[entry - 1] != bits.back()) continue;
                    welded_.push_back(entry - 1);
                    break;
                }
            }
        }
    }

    std::uint32_t vertex(std::size_t primitive, std::size_t vertex) const {
        return welded_[first_[primitive] + vertex];
    }

  private:
    static std::array<std::uint32_t, 3> bitsOf(const glm::vec3& p) {
        const auto bits = [](float x) { return std::bit_cast<std::uint32_t>(x + 0.0F); };
        return {bits(p.x), bits(p.y), bits(p.z)};
    }
    static std::size_t hashOf(const std::array<std::uint32_t, 3>& bits) {
        return mixed(mixed(std::uint64_t{bits[0]} << 32 | bits[1]) + bits[2]);
    }

    std::vector<std::size_t> first_;  // first vertex of each primitive
    std::vector<std::uint32_t> welded_;
};

}  // namespace

/// A filter for edges that occur an odd number of times. Reuses its storage between meshes.
class Solids::EdgeParity {
  public:
    /// Keeps one copy of each edge that occurs an odd number of times; removes all other edges.
    void keepOpen(std::vector<Edge>& list) {
        sort(list);
        std::size_t kept = 0;
        for (std::size_t i = 0, end = 0; i < list.size(); i = end) {
            while (end < list.size() && list[end] == list[i])
                ++end;
            if ((end - i) % 2 == 1) list[kept++] = list[i];
        }
        list.resize(kept);
    }

    std::vector<Edge> edges;  ///< edges of the current primitive

  private:
    /// Sorts the edges into one bucket for each `first`, the smaller vertex, then sorts each
    /// bucket, which has only a few edges. If the range of vertices is large compared with the
    /// number of edges, sorts without buckets.
    void sort(std::vector<Edge>& list) {
        if (list.empty()) return;
        const auto [least, most] = std::ranges::minmax(list, {}, &Edge::first);
        const std::size_t vertices = std::size_t{most.first} - least.first + 1;
        if (vertices > 4 * list.size()) {
            std::ranges::sort(list);
            return;
        }
        next_.assign(vertices + 1, 0);
        for (const Edge& edge : list)
            ++next_[edge.first - least.first + 1];
        for (std::size_t i = 1; i <= vertices; ++i)
            next_[i] += next_[i - 1];
        sorted_.resize(list.size());
        for (const Edge& edge : list)
            sorted_[next_[edge.first - least.first]++] = edge;
        // Each entry of next_ is now the end of its vertex's edges.
        auto begin = sorted_.begin();
        for (std::size_t i = 0; i < vertices; ++i) {
            const auto end = sorted_.begin() + static_cast<std::ptrdiff_t>(next_[i]);
            std::sort(begin, end);
            begin = end;
        }
        std::ranges::copy(sorted_, list.begin());
    }

    std::vector<Edge> sorted_;
    std::vector<std::size_t> next_;
};

namespace {

/// Sums over triangles, from which the facing of a closed surface follows.
struct FacingSum {
    /// Sum of the edges' hashes. Opposite directions of an edge have opposite signs, so the sum is
    /// 0 if every edge is used equally often both ways.
    std::uint64_t edges = 0;
    double six_volumes = 0, six_sizes = 0;  ///< sums of signed and of absolute volumes

    FacingSum& operator+=(const FacingSum& other) {
        edges += other.edges;
        six_volumes += other.six_volumes;
        six_sizes += other.six_sizes;
        return *this;
    }
    void addEdge(std::uint32_t from, std::uint32_t to) {
        const std::uint64_t hash =
            mixed(std::uint64_t{std::min(from, to)} << 32 | std::max(from, to));
        edges += from < to ? hash : -hash;
    }
    SolidFacing facing() const {
        constexpr double kRounding = 1e-6;
        if (edges != 0) return SolidFacing::kMixed;
        return six_volumes < -kRounding * six_sizes ? SolidFacing::kInward : SolidFacing::kOutward;
    }
};

/// Appends the edges of a primitive's triangles, and adds to `sum`. `origin` is any point near the
/// mesh. Returns the number of triangles with three different corners.
std::uint64_t addEdges(const Primitive& primitive, std::size_t index, const WeldedMesh& mesh,
                       std::span<const glm::vec3> positions, const glm::dvec3& origin,
                       std::vector<Edge>& edges, FacingSum& sum) {
    std::uint64_t triangles = 0;
    const std::uint64_t elements = elementsOf(primitive);
    edges.reserve(3 * elements);
    for (std::uint64_t e = 0; e < elements; ++e) {
        const Corners corners = cornersOf(primitive, static_cast<std::uint32_t>(e));
        std::array<std::uint32_t, 3> v{};
        for (std::size_t i = 0; i < 3; ++i)
            v[i] = mesh.vertex(index, corners.vertex[i]);
        if (v[0] == v[1] || v[1] == v[2] || v[2] == v[0]) continue;
        ++triangles;
        std::array<glm::dvec3, 3> p{};
        for (std::size_t i = 0; i < 3; ++i) {
            edges.push_back(std::minmax({v[i], v[(i + 1) % 3]}));
            sum.addEdge(v[i], v[(i + 1) % 3]);
            p[i] = glm::dvec3(positions[corners.vertex[i]]) - origin;
        }
        const double six = glm::dot(p[0], glm::cross(p[1], p[2]));
        sum.six_volumes += six;
        sum.six_sizes += std::abs(six);
    }
    return triangles;
}

}  // namespace

const std::vector<Solids::Shell>& Solids::shellsOf(const PosedScene& posed,
                                                   const MeshInstance& instance,
                                                   EdgeParity& parity) {
    const auto [entry, fresh] = shells_.try_emplace({instance.mesh, instance.deformed});
    std::vector<Shell>& shells = entry->second;
    if (!fresh) return shells;
    const auto& primitives = posed.primitives(instance);
    const WeldedMesh mesh(posed, instance);
    Shell rest;
    FacingSum rest_sum;
    std::optional<glm::dvec3> origin;
    std::vector<Edge> open;
    std::vector<Edge>& edges = parity.edges;
    for (std::size_t i = 0; i < primitives.size(); ++i) {
        if (primitives[i].topology < Topology::kTriangles) continue;
        edges.clear();
        FacingSum sum;
        const auto& positions = posed.positions(instance, i);
        if (!origin && !positions.empty()) origin = positions.front();
        const std::uint64_t triangles =
            addEdges(primitives[i], i, mesh, positions, origin.value_or(glm::dvec3(0)), edges, sum);
        if (triangles == 0) continue;
        parity.keepOpen(edges);
        if (edges.empty()) {
            shells.push_back({{i}, triangles, 0, sum.facing()});
            continue;
        }
        rest_sum += sum;
        rest.primitives.push_back(i);
        rest.triangles += triangles;
        open.insert(open.end(), edges.begin(), edges.end());
    }
    if (!rest.primitives.empty()) {
        // An edge that is open in two primitives is closed in their union. So the open edges of
        // `rest` are the edges that occur an odd number of times among the primitives' open edges.
        parity.keepOpen(open);
        rest.open_edges = open.size();
        if (open.empty()) rest.facing = rest_sum.facing();
        shells.push_back(std::move(rest));
    }
    return shells;
}

Solids::Solids(const PosedScene& posed) : posed_(posed), keys_(posed.drawList().keys()) {
    EdgeParity parity;
    for (std::size_t i = 0; i < posed.meshes().size(); ++i) {
        const MeshInstance& instance = posed.meshes()[i];
        const std::size_t first = surfaces_.size();
        for (const Primitive& p : posed.primitives(instance))
            surfaces_.push_back({kNone, static_cast<std::uint32_t>(p.material)});
        for (const Shell& shell : shellsOf(posed, instance, parity)) {
            for (const std::size_t primitive : shell.primitives)
                surfaces_[first + primitive].solid = static_cast<std::uint32_t>(solids_.size());
            solids_.push_back({i, instance.node, shell.primitives, shell.triangles,
                               shell.open_edges, shell.facing});
        }
    }
}

std::uint64_t Solids::sidesBytes(Overlap overlap) const {
    const bool needed = overlap == Overlap::kWinding && std::ranges::any_of(solids_, &Solid::winds);
    return needed ? TriangleSides::bytes(posed_) : 0;
}

std::optional<TriangleSides> Solids::sides(const Bundle& bundle, Overlap overlap) const {
    if (sidesBytes(overlap) == 0) return {};
    return TriangleSides(posed_, bundle);
}

TriangleSides::TriangleSides(const PosedScene& posed, const Bundle& bundle)
    : posed_(posed),
      bundle_(bundle),
      sides_(bundle.parallel() || bundle.oneEye() ? bytes(posed) : 0) {}

std::uint64_t TriangleSides::bytes(const PosedScene& posed) {
    const auto& surfaces = posed.drawList().surfaces();
    if (surfaces.empty()) return 0;
    const DrawnSurface& last = surfaces.back();
    return last.first_key +
           elementsOf(posed.primitives(posed.meshes()[last.instance])[last.primitive]);
}

std::int8_t TriangleSides::find(std::uint32_t key) const {
    return sideOf(key, bundle_.parallel() ? std::optional(bundle_.direction()) : std::nullopt);
}

/// Returns the side that rays along `direction` cross or, without a direction, rays from the eye.
std::int8_t TriangleSides::sideOf(std::uint32_t key,
                                  const std::optional<glm::dvec3>& direction) const {
    WorldElement element = elementOf(posed_, key);
    placeCorners(posed_, element);
    const glm::dvec3 along = direction.value_or(element.corner[0] - bundle_.origin());
    return glm::dot(element.normal(), along) > 0 ? -1 : 1;
}

/// Finds the solids that the hits enter and leave. Returns false if they are those of the ray
/// before.
bool SolidSpans::cross(std::span<const std::uint32_t> keys, const Solids& solids,
                       const TriangleSides* sides, const Ray* ray) {
    bool differs = keys.size() != crossings_.size();
    crossings_.resize(keys.size());
    for (std::size_t i = 0; i < keys.size(); ++i) {
        Crossing crossing;
        crossing.solid = solids.solidOf(keys[i]);
        if (sides && crossing.solid != Solids::kNone) crossing.turn = sides->turn(keys[i], ray);
        differs |= crossing != crossings_[i];
        crossings_[i] = crossing;
    }
    return differs;
}

void SolidSpans::findHitSpans(const Solids& solids, bool sides) {
    hit_spans_.clear();
    hits_.begin(solids.all().size());
    if (sides)
        for (const Crossing& crossing : crossings_)
            if (crossing.solid != Solids::kNone) hits_[crossing.solid].net += crossing.turn;
    for (std::size_t i = 0; i < crossings_.size(); ++i) {
        const auto [solid, turn] = crossings_[i];
        if (solid == Solids::kNone) continue;
        SolidHits& hits = hits_[solid];
        hits.last = static_cast<std::uint32_t>(i);
        ++hits.hits;
        const bool winds = sides && hits.net == 0 && solids.all()[solid].winds();
        const std::int32_t before = hits.depth;
        hits.depth = winds ? before + turn : 1 - before;
        if (before != 0 && hits.depth != 0) continue;
        if (before != 0) {
            hit_spans_[hits.span].end = hits.last;
            continue;
        }
        hits.span = static_cast<std::uint32_t>(hit_spans_.size());
        hit_spans_.push_back({hits.last, hits.last, solid});
    }
}

void SolidSpans::find(std::span<const float> t, std::span<const std::uint32_t> keys,
                      const Solids& solids, const TriangleSides* sides, const Ray* ray) {
    if (cross(keys, solids, sides, ray)) findHitSpans(solids, sides != nullptr);
    spans_.clear();
    for (const auto& [begin, end, solid] : hit_spans_)
        if (t[end] > t[begin]) spans_.push_back({{t[begin], t[end]}, solid, keys[begin], begin});
    for (std::size_t i = 0, end = 0; i < spans_.size(); i = end) {
        while (end < spans_.size() && spans_[end].begin == spans_[i].begin)
            ++end;
        if (end - i == 1) continue;
        std::stable_sort(spans_.begin() + static_cast<std::ptrdiff_t>(i),
                         spans_.begin() + static_cast<std::ptrdiff_t>(end),
                         [](const SolidSpan& a, const SolidSpan& b) { return a.end > b.end; });
    }
}

bool Parity::addRay(const SolidSpans& spans, std::span<const float> z, OddRay ray,
                    SparseSet<SolidParity>& found) {
    bool odd = false;
    for (const auto& [solid, hits] : spans.hits()) {
        SolidParity& parity = found[solid];
        ++parity.rays;
        if (!hits.odd()) continue;
        odd = true;
        ++parity.odd;
        ray.z = z[hits.last];
        if (parity.first.size() < kKept) parity.first.push_back(ray);
    }
    return odd;
}

void Parity::add(std::size_t bundle, const LayeredImage& band) {
    constexpr int kRows = 16;
    struct Share {
        std::vector<SparseSet<SolidParity>::Entry> solids;
        std::uint64_t odd_rays = 0;
    };
    const Window& window = band.window;
    const std::span<const std::uint32_t> keys = band.extra[0].as<std::uint32_t>();
    std::vector<Share> shares(static_cast<std::size_t>((window.height() + kRows - 1) / kRows));
    parallelFor(shares.size(), [&](std::size_t i) {
        scratch_.with([&](Scratch& scratch) {
            scratch.found.begin(solids_.all().size());
            const int y0 = window.y0 + static_cast<int>(i) * kRows;
            for (int y = y0; y < std::min(y0 + kRows, window.y1); ++y) {
                for (int x = window.x0; x < window.x1; ++x) {
                    const std::size_t pixel = band.pixelIndex(x, y);
                    const std::size_t begin = band.offsets[pixel], hits = band.count(pixel);
                    if (hits == 0) continue;
                    const std::span<const float> z(band.z.data() + begin, hits);
                    scratch.spans.find(z, keys.subspan(begin, hits), solids_);
                    if (addRay(scratch.spans, z, {bundle, x, y}, scratch.found))
                        ++shares[i].odd_rays;
                }
            }
            shares[i].solids = scratch.found.take();
        });
    });
    for (const Share& share : shares) {
        odd_rays_ += share.odd_rays;
        for (const auto& [solid, more] : share.solids) {
            SolidParity& parity = found_[solid];
            parity.rays += more.rays;
            parity.odd += more.odd;
            for (const OddRay& ray : more.first)
                if (parity.first.size() < kKept) parity.first.push_back(ray);
        }
    }
}

}  // namespace peeler
