// SPDX-License-Identifier: Apache-2.0
#include "core/rays/solids.h"

#include <algorithm>
#include <array>
#include <bit>
#include <tuple>

#include "core/base/parallel.h"
#include "core/scene/elements.h"

namespace peeler {
namespace {

using Edge = std::pair<std::uint32_t, std::uint32_t>;  // welded vertices, the lesser first

/// The vertices of all primitives of a mesh, those at one position as one.
class WeldedMesh {
  public:
    WeldedMesh(const PosedScene& posed, const MeshInstance& instance) {
        const auto& primitives = posed.primitives(instance);
        std::vector<Place> places;
        for (std::size_t i = 0; i < primitives.size(); ++i) {
            first_.push_back(places.size());
            if (primitives[i].topology < Topology::kTriangles) continue;
            for (const glm::vec3& p : posed.positions(instance, i))
                places.push_back({bitsOf(p), static_cast<std::uint32_t>(places.size())});
        }
        std::sort(places.begin(), places.end(), [](const Place& a, const Place& b) {
            return std::tie(a.bits, a.vertex) < std::tie(b.bits, b.vertex);
        });
        welded_.resize(places.size());
        std::uint32_t one = 0;
        for (std::size_t i = 0; i < places.size(); ++i) {
            if (i == 0 || places[i].bits != places[i - 1].bits) one = places[i].vertex;
            welded_[places[i].vertex] = one;
        }
    }

    std::uint32_t vertex(std::size_t primitive, std::size_t vertex) const {
        return welded_[first_[primitive] + vertex];
    }

  private:
    struct Place {
        std::array<std::uint32_t, 3> bits;
        std::uint32_t vertex;
    };
    static std::array<std::uint32_t, 3> bitsOf(const glm::vec3& p) {
        const auto bits = [](float x) { return std::bit_cast<std::uint32_t>(x + 0.0F); };
        return {bits(p.x), bits(p.y), bits(p.z)};
    }

    std::vector<std::size_t> first_;  // vertex of each primitive
    std::vector<std::uint32_t> welded_;
};

/// Leaves the edges that are there an odd number of times, each once.
void keepOpen(std::vector<Edge>& edges) {
    std::sort(edges.begin(), edges.end());
    std::size_t kept = 0;
    for (std::size_t i = 0, end = 0; i < edges.size(); i = end) {
        while (end < edges.size() && edges[end] == edges[i])
            ++end;
        if ((end - i) % 2 == 1) edges[kept++] = edges[i];
    }
    edges.resize(kept);
}

/// Appends the edges of a primitive's triangles; returns how many of these have three corners.
std::uint64_t addEdges(const Primitive& primitive, std::size_t index, const WeldedMesh& mesh,
                       std::vector<Edge>& edges) {
    std::uint64_t triangles = 0;
    const std::uint64_t elements = elementsOf(primitive);
    for (std::uint64_t e = 0; e < elements; ++e) {
        const Corners corners = cornersOf(primitive, static_cast<std::uint32_t>(e));
        std::array<std::uint32_t, 3> v{};
        for (std::size_t i = 0; i < 3; ++i)
            v[i] = mesh.vertex(index, corners.vertex[i]);
        if (v[0] == v[1] || v[1] == v[2] || v[2] == v[0]) continue;
        ++triangles;
        for (std::size_t i = 0; i < 3; ++i)
            edges.push_back(std::minmax({v[i], v[(i + 1) % 3]}));
    }
    return triangles;
}

}  // namespace

const std::vector<Solids::Shell>& Solids::shellsOf(const PosedScene& posed,
                                                   const MeshInstance& instance) {
    const auto [entry, fresh] = shells_.try_emplace({instance.mesh, instance.deformed});
    std::vector<Shell>& shells = entry->second;
    if (!fresh) return shells;
    const auto& primitives = posed.primitives(instance);
    const WeldedMesh mesh(posed, instance);
    Shell rest;
    std::vector<Edge> open, edges;
    for (std::size_t i = 0; i < primitives.size(); ++i) {
        if (primitives[i].topology < Topology::kTriangles) continue;
        edges.clear();
        const std::uint64_t triangles = addEdges(primitives[i], i, mesh, edges);
        if (triangles == 0) continue;
        keepOpen(edges);
        if (edges.empty()) {
            shells.push_back({{i}, triangles, 0});
            continue;
        }
        rest.primitives.push_back(i);
        rest.triangles += triangles;
        open.insert(open.end(), edges.begin(), edges.end());
    }
    if (!rest.primitives.empty()) {
        // Two odd numbers make an even one: what is open of all is odd among what is open of each.
        keepOpen(open);
        rest.open_edges = open.size();
        shells.push_back(std::move(rest));
    }
    return shells;
}

Solids::Solids(const PosedScene& posed) {
    std::uint64_t key = 1;
    for (std::size_t i = 0; i < posed.meshes().size(); ++i) {
        const MeshInstance& instance = posed.meshes()[i];
        const std::size_t first = surfaces_.size();
        for (const Primitive& p : posed.primitives(instance)) {
            first_keys_.push_back(static_cast<std::uint32_t>(key));
            surfaces_.push_back({kNone, static_cast<std::uint32_t>(p.material)});
            key += elementsOf(p);
        }
        for (const Shell& shell : shellsOf(posed, instance)) {
            for (const std::size_t primitive : shell.primitives)
                surfaces_[first + primitive].solid = static_cast<std::uint32_t>(solids_.size());
            solids_.push_back(
                {i, instance.node, shell.primitives, shell.triangles, shell.open_edges});
        }
    }
}

const Solids::Surface& Solids::surfaceOf(std::uint32_t key) const {
    // The last of those that begin there: primitives without elements begin there, too.
    const auto after = std::upper_bound(first_keys_.begin(), first_keys_.end(), key);
    return surfaces_[static_cast<std::size_t>(after - first_keys_.begin()) - 1];
}

void SolidSpans::find(std::span<const float> t, std::span<const std::uint32_t> keys,
                      const Solids& solids) {
    order_.clear();
    spans_.clear();
    hits_.clear();
    for (std::size_t i = 0; i < keys.size(); ++i) {
        const std::uint32_t solid = solids.solidOf(keys[i]);
        if (solid != Solids::kNone) order_.push_back({solid, static_cast<std::uint32_t>(i)});
    }
    std::sort(order_.begin(), order_.end(), [](const Hit& a, const Hit& b) {
        return std::tie(a.solid, a.index) < std::tie(b.solid, b.index);
    });
    for (std::size_t i = 0, end = 0; i < order_.size(); i = end) {
        const std::uint32_t solid = order_[i].solid;
        while (end < order_.size() && order_[end].solid == solid)
            ++end;
        hits_.push_back({solid, static_cast<std::uint32_t>(end - i), order_[end - 1].index});
        for (std::size_t k = i; k + 1 < end; k += 2) {
            const std::uint32_t in = order_[k].index, out = order_[k + 1].index;
            if (t[out] > t[in]) spans_.push_back({{t[in], t[out]}, solid, keys[in], in});
        }
    }
    std::sort(spans_.begin(), spans_.end(), [](const SolidSpan& a, const SolidSpan& b) {
        return std::tie(a.begin, b.end, a.hit) < std::tie(b.begin, a.end, b.hit);
    });
}

namespace {

/// What some rows of a band add to the counts.
struct Share {
    std::map<std::uint32_t, SolidParity> solids;
    std::uint64_t odd_rays = 0;
};

void addRay(std::span<const SolidHits> hits, std::span<const float> z, OddRay ray, Share& share) {
    bool odd = false;
    for (const SolidHits& solid : hits) {
        SolidParity& parity = share.solids[solid.solid];
        ++parity.rays;
        if (!solid.odd()) continue;
        odd = true;
        ++parity.odd;
        ray.z = z[solid.last];
        if (parity.first.size() < Parity::kKept) parity.first.push_back(ray);
    }
    if (odd) ++share.odd_rays;
}

}  // namespace

void Parity::add(std::size_t bundle, const LayeredImage& band) {
    constexpr int kRows = 16;
    const Window& window = band.window;
    const std::span<const std::uint32_t> keys = band.extra[0].as<std::uint32_t>();
    std::vector<Share> shares(static_cast<std::size_t>((window.height() + kRows - 1) / kRows));
    parallelFor(shares.size(), [&](std::size_t i) {
        SolidSpans spans;
        const int y0 = window.y0 + static_cast<int>(i) * kRows;
        for (int y = y0; y < std::min(y0 + kRows, window.y1); ++y) {
            for (int x = window.x0; x < window.x1; ++x) {
                const std::size_t pixel = band.pixelIndex(x, y);
                const std::size_t begin = band.offsets[pixel], hits = band.count(pixel);
                if (hits == 0) continue;
                const std::span<const float> z(band.z.data() + begin, hits);
                spans.find(z, keys.subspan(begin, hits), solids_);
                addRay(spans.hits(), z, {bundle, x, y}, shares[i]);
            }
        }
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
