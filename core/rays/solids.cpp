// SPDX-License-Identifier: Apache-2.0
#include "core/rays/solids.h"

#include <algorithm>
#include <array>
#include <bit>
#include <cmath>
#include <numeric>
#include <optional>

#include "core/base/parallel.h"
#include "core/scene/elements.h"

namespace peeler {
namespace {

/// The finaliser of splitmix64 (Steele, Lea and Flood 2014).
std::uint64_t mixed(std::uint64_t hash) {
    hash = (hash ^ hash >> 30) * 0xBF58476D1CE4E5B9U;
    hash = (hash ^ hash >> 27) * 0x94D049BB133111EBU;
    return hash ^ hash >> 31;
}

/// Writes a hash of each position to `hashes`. Equal positions have equal hashes; those of others
/// differ except by chance (2^-64).
void hashPositions(std::span<const glm::vec3> positions, std::vector<std::uint64_t>& hashes) {
    const auto bits = [](float x) { return std::bit_cast<std::uint32_t>(x + 0.0F); };
    hashes.resize(positions.size());
    std::ranges::transform(positions, hashes.begin(), [&](const glm::vec3& p) {
        return mixed(mixed(std::uint64_t{bits(p.x)} << 32 | bits(p.y)) + bits(p.z));
    });
}

/// Returns the hash of an edge, which is the same in both directions.
std::uint64_t edgeOf(std::uint64_t from, std::uint64_t to) {
    return mixed(from + to);
}

/// Calls use(vertices, hashes) with every triangle that has three different corners.
template <class Use>
void forEachTriangle(const Primitive& primitive, std::span<const std::uint64_t> hashes, Use&& use) {
    const auto elements = static_cast<std::uint32_t>(elementsOf(primitive));
    for (std::uint32_t element = 0; element < elements; ++element) {
        const std::array<std::size_t, 3> vertex = cornersOf(primitive, element).vertex;
        const std::array<std::uint64_t, 3> hash = {hashes[vertex[0]], hashes[vertex[1]],
                                                   hashes[vertex[2]]};
        if (hash[0] != hash[1] && hash[1] != hash[2] && hash[2] != hash[0]) use(vertex, hash);
    }
}

/// Sums over triangles, from which it follows whether a surface is closed, and its facing.
struct SurfaceSum {
    std::uint64_t triangles = 0;
    /// Exclusive or of the edges' hashes: 0 if every edge occurs an even number of times.
    std::uint64_t odd_edges = 0;
    /// Sum of the edges' hashes. Opposite directions of an edge have opposite signs, so the sum is
    /// 0 if every edge is used equally often both ways.
    std::uint64_t edges = 0;
    double six_volumes = 0, six_sizes = 0;  ///< sums of signed and of absolute volumes

    SurfaceSum& operator+=(const SurfaceSum& other) {
        triangles += other.triangles;
        odd_edges ^= other.odd_edges;
        edges += other.edges;
        six_volumes += other.six_volumes;
        six_sizes += other.six_sizes;
        return *this;
    }
    void addEdge(std::uint64_t from, std::uint64_t to) {
        const std::uint64_t hash = edgeOf(from, to);
        odd_edges ^= hash;
        edges += from < to ? hash : -hash;
    }
    bool closed() const { return odd_edges == 0; }
    SolidFacing facing() const {
        constexpr double kRounding = 1e-6;
        if (edges != 0) return SolidFacing::kMixed;
        return six_volumes < -kRounding * six_sizes ? SolidFacing::kInward : SolidFacing::kOutward;
    }
};

/// Returns the sum of a primitive. `origin` is any point near the mesh.
SurfaceSum sumOf(const Primitive& primitive, std::span<const glm::vec3> positions,
                 std::span<const std::uint64_t> hashes, const glm::dvec3& origin) {
    SurfaceSum sum;
    forEachTriangle(primitive, hashes, [&](const auto& vertex, const auto& hash) {
        ++sum.triangles;
        std::array<glm::dvec3, 3> p;
        for (std::size_t i = 0; i < 3; ++i) {
            sum.addEdge(hash[i], hash[(i + 1) % 3]);
            p[i] = glm::dvec3(positions[vertex[i]]) - origin;
        }
        const double six = glm::dot(p[0], glm::cross(p[1], p[2]));
        sum.six_volumes += six;
        sum.six_sizes += std::abs(six);
    });
    return sum;
}

/// Returns how many of the numbers occur an odd number of times. The numbers must be hashes.
std::uint64_t countOdd(std::span<const std::uint64_t> numbers) {
    constexpr std::size_t kBucket = 8;  // numbers in a bucket, on average
    const std::size_t buckets = std::bit_ceil(numbers.size() / kBucket + 2);
    const int shift = 64 - std::countr_zero(buckets);
    std::vector<std::size_t> end(buckets + 1);
    for (const std::uint64_t number : numbers)
        ++end[(number >> shift) + 1];
    std::partial_sum(end.begin(), end.end(), end.begin());
    std::vector<std::uint64_t> sorted(numbers.size());
    for (const std::uint64_t number : numbers)
        sorted[end[number >> shift]++] = number;
    std::uint64_t odd = 0;
    auto begin = sorted.begin();
    for (std::size_t bucket = 0; bucket < buckets; ++bucket) {
        const auto next = sorted.begin() + static_cast<std::ptrdiff_t>(end[bucket]);
        std::sort(begin, next);
        while (begin < next) {
            const auto other = std::find_if(begin, next, [&](auto n) { return n != *begin; });
            odd += static_cast<std::uint64_t>(other - begin) % 2;
            begin = other;
        }
    }
    return odd;
}

}  // namespace

const std::vector<Solids::Shell>& Solids::shellsOf(const PosedScene& posed,
                                                   const MeshInstance& instance) {
    const auto [entry, fresh] = shells_.try_emplace({instance.mesh, instance.deformed});
    std::vector<Shell>& shells = entry->second;
    if (!fresh) return shells;
    const auto& primitives = posed.primitives(instance);
    Shell rest;
    SurfaceSum rest_sum;
    std::optional<glm::dvec3> origin;
    std::vector<std::uint64_t> hashes, edges;
    for (std::size_t i = 0; i < primitives.size(); ++i) {
        if (primitives[i].topology < Topology::kTriangles) continue;
        const auto& positions = posed.positions(instance, i);
        if (!origin && !positions.empty()) origin = positions.front();
        hashPositions(positions, hashes);
        const SurfaceSum sum =
            sumOf(primitives[i], positions, hashes, origin.value_or(glm::dvec3(0)));
        if (sum.triangles == 0) continue;
        if (sum.closed()) {
            shells.push_back({{i}, sum.triangles, 0, sum.facing()});
            continue;
        }
        rest_sum += sum;
        rest.primitives.push_back(i);
    }
    if (rest.primitives.empty()) return shells;
    rest.triangles = rest_sum.triangles;
    if (rest_sum.closed()) {
        rest.facing = rest_sum.facing();
    } else {
        edges.reserve(3 * rest.triangles);
        for (const std::size_t i : rest.primitives) {
            hashPositions(posed.positions(instance, i), hashes);
            forEachTriangle(primitives[i], hashes, [&](const auto&, const auto& hash) {
                for (std::size_t k = 0; k < 3; ++k)
                    edges.push_back(edgeOf(hash[k], hash[(k + 1) % 3]));
            });
        }
        rest.open_edges = countOdd(edges);
    }
    shells.push_back(std::move(rest));
    return shells;
}

Solids::Solids(const PosedScene& posed) : posed_(posed), keys_(posed.drawList().keys()) {
    for (std::size_t i = 0; i < posed.meshes().size(); ++i) {
        const MeshInstance& instance = posed.meshes()[i];
        const std::size_t first = surfaces_.size();
        for (const Primitive& p : posed.primitives(instance))
            surfaces_.push_back({kNone, static_cast<std::uint32_t>(p.material)});
        for (const Shell& shell : shellsOf(posed, instance)) {
            const Solid& solid =
                solids_.emplace_back(Solid{i, instance.node, shell.primitives, shell.triangles,
                                           shell.open_edges, shell.facing});
            for (const std::size_t primitive : shell.primitives) {
                Surface& surface = surfaces_[first + primitive];
                surface.solid = static_cast<std::uint32_t>(solids_.size() - 1);
                surface.winds = solid.winds();
            }
        }
    }
}

namespace {

/// Whether all rays of a bundle cross a triangle in the same direction.
bool isBundled(const Bundle& bundle) {
    return bundle.parallel() || bundle.oneEye();
}

}  // namespace

std::uint64_t Solids::sidesBytes(Overlap overlap) const {
    const bool needed = overlap == Overlap::kWinding && std::ranges::any_of(solids_, &Solid::winds);
    return needed ? TriangleSides::bytes(posed_) : 0;
}

std::optional<TriangleSides> Solids::sides(std::span<const Bundle> bundles, Overlap overlap) const {
    if (sidesBytes(overlap) == 0) return {};
    return TriangleSides(posed_, bundles);
}

TriangleSides::TriangleSides(const PosedScene& posed, std::span<const Bundle> bundles)
    : posed_(posed),
      keys_(&posed_.drawList().keys()),
      sides_(std::ranges::all_of(bundles, isBundled) ? bytes(posed) : 0) {
    for (const Bundle& bundle : bundles)
        ways_.push_back(
            {bundle.parallel(), bundle.parallel() ? bundle.direction() : bundle.origin()});
    for (const DrawnSurface& surface : posed_.drawList().surfaces()) {
        const MeshInstance& instance = posed_.meshes()[surface.instance];
        const Primitive& primitive = posed_.primitives(instance)[surface.primitive];
        surfaces_.push_back({&primitive, posed_.positions(instance, surface.primitive).data(),
                             &instance, surface.first_key,
                             static_cast<std::uint32_t>(elementsOf(primitive))});
    }
}

std::uint64_t TriangleSides::bytes(const PosedScene& posed) {
    const auto& surfaces = posed.drawList().surfaces();
    if (surfaces.empty()) return 0;
    const DrawnSurface& last = surfaces.back();
    return last.first_key +
           elementsOf(posed.primitives(posed.meshes()[last.instance])[last.primitive]);
}

TriangleSides::Plane TriangleSides::planeOf(const Surface& surface, std::uint32_t element) {
    const Corners corners = cornersOf(*surface.primitive, element);
    std::array<glm::dvec3, 3> p;
    for (std::size_t i = 0; i < 3; ++i)
        p[i] = glm::dvec3(surface.instance->world *
                          glm::dvec4(glm::dvec3(surface.positions[corners.vertex[i]]), 1));
    const glm::dvec3 normal = glm::cross(p[1] - p[0], p[2] - p[0]);
    return {p[0], surface.instance->mirrored ? -normal : normal};
}

int TriangleSides::turnOf(std::uint32_t key, const glm::dvec3& direction) const {
    const Surface& surface = surfaces_[keys_->surfaceOf(key)];
    return glm::dot(planeOf(surface, key - surface.first_key).normal, direction) > 0 ? -1 : 1;
}

/// Finds the sides of a triangle and its neighbours in memory, which are mostly hit too.
std::uint8_t TriangleSides::find(std::uint32_t key) const {
    constexpr std::uint32_t kAtOnce = 16;
    const Surface& surface = surfaces_[keys_->surfaceOf(key)];
    const std::uint32_t wanted = key - surface.first_key, first = wanted - wanted % kAtOnce;
    const std::uint32_t end = std::min(first + kAtOnce, surface.triangles);
    std::array<std::uint8_t, kAtOnce> sides;
    for (std::uint32_t element = first; element < end; ++element) {
        const Plane plane = planeOf(surface, element);
        unsigned side = 1U << kMostBundles;
        for (std::size_t i = 0; i < ways_.size(); ++i) {
            const glm::dvec3 along = ways_[i].parallel ? ways_[i].at : plane.corner - ways_[i].at;
            side |= (glm::dot(plane.normal, along) > 0 ? 1U : 0U) << i;
        }
        sides[element - first] = static_cast<std::uint8_t>(side);
        std::atomic_ref(sides_[surface.first_key + element])
            .store(sides[element - first], std::memory_order_relaxed);
    }
    return sides[wanted - first];
}

void SolidSpans::prepare(std::span<const std::uint32_t> keys, const Solids& solids,
                         const TriangleSides* sides, const Ray* ray, std::size_t bundle) {
    solids_ = solids.all().size();
    prepared_.resize(keys.size());
    for (std::size_t i = 0; i < keys.size(); ++i) {
        const Solids::Surface& surface = solids.surfaceOf(keys[i]);
        prepared_[i] = {surface.solid,
                        sides && surface.winds ? sides->turn(keys[i], ray, bundle) : 0};
    }
}

bool SolidSpans::begin(std::size_t first, std::size_t count) {
    const auto crossings = std::span<const Crossing>(prepared_).subspan(first, count);
    if (std::ranges::equal(crossings, crossings_)) return false;
    crossings_.assign(crossings.begin(), crossings.end());
    findHitSpans();
    return true;
}

void SolidSpans::findHitSpans() {
    hit_spans_.clear();
    hits_.begin(solids_);
    for (const Crossing& crossing : crossings_)
        if (crossing.turn != 0) hits_[crossing.solid].net += crossing.turn;
    for (std::size_t i = 0; i < crossings_.size(); ++i) {
        const auto [solid, turn] = crossings_[i];
        if (solid == Solids::kNone) continue;
        SolidHits& hits = hits_[solid];
        hits.last = static_cast<std::uint32_t>(i);
        ++hits.hits;
        const std::int32_t before = hits.depth;
        hits.depth = turn != 0 && hits.net == 0 ? before + turn : 1 - before;
        if (before != 0 && hits.depth != 0) continue;
        if (before != 0) {
            hit_spans_[hits.span].end = hits.last;
            continue;
        }
        hits.span = static_cast<std::uint32_t>(hit_spans_.size());
        hit_spans_.push_back({hits.last, hits.last, solid});
    }
    outer_.clear();
    for (const HitSpan& span : hit_spans_) {
        if (span.end == span.begin) continue;
        if (outer_.empty() || span.begin > outer_.back().end)
            outer_.push_back(span);
        else
            outer_.back().end = std::max(outer_.back().end, span.end);
    }
}

void SolidSpans::place(std::span<const float> t, std::span<const std::uint32_t> keys) {
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

/// Ends a run of rays that cross the same solids.
void Parity::Scratch::endRun() {
    if (run == 0) return;
    for (const std::uint32_t solid : hit)
        found[solid].rays += run;
    run = 0;
}

/// Adds a ray with the prepared hits from `first` on. Returns whether it hits a solid an odd number
/// of times.
bool Parity::Scratch::add(std::span<const float> z, std::size_t first, OddRay ray) {
    if (spans.begin(first, z.size())) {
        endRun();
        hit.clear();
        odd = false;
        for (const auto& [solid, hits] : spans.hits()) {
            hit.push_back(solid);
            odd |= hits.odd();
        }
    }
    ++run;
    if (!odd) return false;
    for (const auto& [solid, hits] : spans.hits()) {
        if (!hits.odd()) continue;
        SolidParity& parity = found[solid];
        ++parity.odd;
        ray.z = z[hits.last];
        if (parity.first.size() < kKept) parity.first.push_back(ray);
    }
    return true;
}

void Parity::add(std::size_t bundle, const LayeredImage& band) {
    constexpr int kRows = 16;
    struct Share {
        std::vector<SparseSet<SolidParity>::Entry> solids;
        std::uint64_t odd_rays = 0;
    };
    const Window& window = band.window;
    const std::span<const float> z(band.z);
    const std::span<const std::uint32_t> keys = band.extra[0].as<std::uint32_t>();
    std::vector<Share> shares(static_cast<std::size_t>((window.height() + kRows - 1) / kRows));
    parallelFor(shares.size(), [&](std::size_t i) {
        scratch_.with([&](Scratch& scratch) {
            scratch.found.begin(solids_.all().size());
            const int y0 = window.y0 + static_cast<int>(i) * kRows;
            for (int y = y0; y < std::min(y0 + kRows, window.y1); ++y) {
                const std::size_t row = band.pixelIndex(window.x0, y);
                const std::uint32_t* const offsets = band.offsets.data() + row;
                const std::size_t first = offsets[0];
                scratch.spans.prepare(keys.subspan(first, offsets[window.width()] - first),
                                      solids_);
                for (int x = 0; x < window.width(); ++x) {
                    const std::size_t begin = offsets[x], hits = offsets[x + 1] - begin;
                    if (hits == 0) continue;
                    if (scratch.add(z.subspan(begin, hits), begin - first,
                                    {bundle, window.x0 + x, y}))
                        ++shares[i].odd_rays;
                }
            }
            scratch.endRun();
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
