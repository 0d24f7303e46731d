// SPDX-License-Identifier: Apache-2.0
// Closed solids, the intervals of rays inside them, and a check of the parity of their hits.
#pragma once

#include <atomic>
#include <cstddef>
#include <cstdint>
#include <map>
#include <optional>
#include <span>
#include <utility>
#include <vector>

#include <peeler/bundle.h>
#include <peeler/layered_image.h>
#include "core/base/parallel.h"
#include "core/base/sparse_set.h"
#include "core/lens/picture_rays.h"
#include "core/scene/draw_list.h"
#include "core/scene/posed_scene.h"

namespace peeler {

/// The rule for the inside of a solid.
enum class Overlap : std::uint8_t {
    kWinding,  ///< nonzero winding number: shells that overlap are one body
    kParity,   ///< odd number of hits: shells cancel out where they overlap
};

/// The direction that a solid's triangles face.
enum class SolidFacing : std::uint8_t {
    kOutward,
    kInward,  ///< the volume is negative
    kMixed,   ///< open, or adjacent triangles run along their common edge in the same direction
};

/// The surface of a body. If the surface is closed, a ray that enters the body also leaves it.
struct Solid {
    std::size_t instance = 0;  ///< index into PosedScene::meshes()
    int node = 0;
    std::span<const std::size_t> primitives{};  ///< indices of the primitives in the mesh
    std::uint64_t triangles = 0;  ///< number of triangles with three different corners
    std::uint64_t open_edges = 0;
    SolidFacing facing = SolidFacing::kMixed;

    bool closed() const { return open_edges == 0; }
    /// Whether Overlap::kWinding decides the inside.
    bool winds() const { return facing == SolidFacing::kOutward; }
};

/// The directions in which a bundle's rays cross triangles: into or out of the solid. All rays that
/// are parallel or begin at one point cross a triangle in the same direction, which is computed on
/// first use. Thread-safe.
class TriangleSides {
  public:
    TriangleSides(const PosedScene& posed, const Bundle& bundle);

    /// Whether turn() needs the ray.
    bool needRay() const { return sides_.empty(); }
    /// Returns 1 if rays enter through the triangle of a key, −1 if they leave. `ray` may be null
    /// unless needRay().
    int turn(std::uint32_t key, const Ray* ray = nullptr) const {
        if (needRay()) return sideOf(key, ray->direction);
        const std::atomic_ref side(sides_[key]);
        std::int8_t known = side.load(std::memory_order_relaxed);
        if (known == 0) side.store(known = find(key), std::memory_order_relaxed);
        return known;
    }
    /// Returns the bytes that the sides of a scene take.
    static std::uint64_t bytes(const PosedScene& posed);

  private:
    std::int8_t find(std::uint32_t key) const;
    std::int8_t sideOf(std::uint32_t key, const std::optional<glm::dvec3>& direction) const;

    PosedScene posed_;
    Bundle bundle_;
    mutable std::vector<std::int8_t> sides_;  ///< by key; 0 = not found yet
};

/// The solids of a scene. glTF does not mark closed surfaces, so the topology decides. Vertices at
/// the same position (bit for bit; −0 is 0) are welded, and an edge is open if an odd number of
/// triangles share it. Every primitive of a mesh that is closed by itself is a solid. All other
/// primitives of the mesh together form one more solid, so a cube with different materials on its
/// sides is one solid. Lines and points belong to no solid. The topology of a mesh is found once
/// for all its instances, and once for each deformation.
class Solids {
  public:
    static constexpr std::uint32_t kNone = 0xFFFFFFFFU;

    /// Temporarily takes about 30 bytes per triangle and 30 bytes per vertex of a mesh to find its
    /// topology.
    explicit Solids(const PosedScene& posed);
    Solids(const Solids&) = delete;
    Solids& operator=(const Solids&) = delete;

    /// Returns the solids in draw order.
    const std::vector<Solid>& all() const { return solids_; }
    /// Returns the solid of a key (DrawList): an index into all(), or kNone.
    std::uint32_t solidOf(std::uint32_t key) const { return surfaceOf(key).solid; }
    /// Returns the sides of triangles; nullopt if the rule needs no sides.
    std::optional<TriangleSides> sides(const Bundle& bundle, Overlap overlap) const;
    /// Returns the bytes of sides().
    std::uint64_t sidesBytes(Overlap overlap) const;
    /// Returns the material of a key: an index into Scene::materials.
    std::size_t materialOf(std::uint32_t key) const { return surfaceOf(key).material; }

  private:
    /// The solid and the material of one primitive of one instance.
    struct Surface {
        std::uint32_t solid = kNone, material = 0;
    };
    /// The part of a mesh that becomes one solid in each instance of the mesh.
    struct Shell {
        std::vector<std::size_t> primitives;
        std::uint64_t triangles = 0, open_edges = 0;
        SolidFacing facing = SolidFacing::kMixed;
    };

    const Surface& surfaceOf(std::uint32_t key) const { return surfaces_[keys_.surfaceOf(key)]; }
    class EdgeParity;
    const std::vector<Shell>& shellsOf(const PosedScene& posed, const MeshInstance& instance,
                                       EdgeParity& parity);

    PosedScene posed_;
    std::vector<Solid> solids_;
    KeyIndex keys_;                  // a copy, since the draw list may be destroyed earlier
    std::vector<Surface> surfaces_;  // one for each surface of keys_
    /// Shells of each mesh and deformation.
    std::map<std::pair<int, int>, std::vector<Shell>> shells_;
};

/// An interval of a ray, in t.
struct RayInterval {
    double begin = 0, end = 0;

    double length() const { return end - begin; }
    bool operator==(const RayInterval&) const = default;
};

/// An interval inside one solid.
struct SolidSpan : RayInterval {
    std::uint32_t solid = 0;  ///< index into Solids::all()
    std::uint32_t key = 0;    ///< key of the hit at which the ray enters
    std::uint32_t hit = 0;    ///< index of the entering hit among the ray's hits
};

/// The count of a ray's hits on one solid.
struct SolidHits {
    std::uint32_t hits = 0;
    std::int32_t net = 0;    ///< entries minus exits of the whole ray
    std::int32_t depth = 0;  ///< while find() runs: winding number, or parity; 0 is outside
    std::uint32_t last = 0;  ///< index of the last hit in the ray's hits
    std::uint32_t span = 0;  ///< index of the latest span, while find() runs

    bool odd() const { return hits % 2 == 1; }
};

/// The spans of a ray inside solids. By parity, spans begin at the 1st, 3rd, 5th ... hit of a solid
/// and end at the next hit; an unpaired last hit begins no span. By winding number, a span begins
/// where the ray has entered the solid more (or less) often than left it, and ends where both
/// numbers are equal again. Reuses its storage between rays. One per thread.
///
/// Neighbouring rays mostly cross the same solids in the same order, and this order alone decides
/// at which hits spans begin and end. So it is evaluated only if it differs from the ray before.
class SolidSpans {
  public:
    /// Finds the spans of a ray. `t` is in ascending order. `keys` are those of DrawList, with
    /// coincident hits in draw order. `sides`: Solids::sides() of the ray's bundle, or null. `ray`
    /// may be null unless the sides need it. Parity
    /// replaces winding numbers if `sides` is null, for solids that do not face outwards, and for
    /// solids that the ray does not leave as often as it enters them (because it grazes triangles).
    void find(std::span<const float> t, std::span<const std::uint32_t> keys, const Solids& solids,
              const TriangleSides* sides = nullptr, const Ray* ray = nullptr);

    /// Returns the spans of non-zero length, ordered by their beginnings. If several spans begin
    /// together, the longest is first, so that the others are inside it.
    std::span<const SolidSpan> all() const { return spans_; }
    /// Returns every solid that the ray hits, with the hit count.
    const std::vector<SparseSet<SolidHits>::Entry>& hits() const { return hits_.entries(); }

  private:
    /// A span, by the indices of the hits at which it begins and ends.
    struct HitSpan {
        std::uint32_t begin = 0, end = 0, solid = 0;
    };
    /// A hit's solid and turn (TriangleSides). The turn is 0 without sides or solid.
    struct Crossing {
        std::uint32_t solid = Solids::kNone;
        std::int32_t turn = 0;
        bool operator==(const Crossing&) const = default;
    };

    bool cross(std::span<const std::uint32_t> keys, const Solids& solids,
               const TriangleSides* sides, const Ray* ray);
    void findHitSpans(const Solids& solids, bool sides);

    std::vector<Crossing> crossings_;  ///< of the ray's hits
    std::vector<HitSpan> hit_spans_;
    std::vector<SolidSpan> spans_;
    SparseSet<SolidHits> hits_;
};

/// Writes the union of the spans for which `keep(span)` is true to `out`, as ordered intervals.
/// Joins adjacent intervals. Overwrites `out`.
template <class Keep>
void uniteSpans(std::span<const SolidSpan> spans, Keep&& keep, std::vector<RayInterval>& out) {
    out.clear();
    for (const SolidSpan& span : spans) {
        if (!keep(span)) continue;
        if (out.empty() || span.begin > out.back().end) {
            out.push_back(span);
        } else if (span.end > out.back().end) {
            out.back().end = span.end;
        }
    }
}

/// A ray that hits a solid an odd number of times.
struct OddRay {
    std::size_t bundle = 0;
    int x = 0, y = 0;  ///< the ray's pixel in the bundle's picture
    float z = 0;       ///< camera Z of the last hit, which is unpaired
    bool operator==(const OddRay&) const = default;
};

struct SolidParity {
    std::uint64_t rays = 0;     ///< number of rays that hit the solid
    std::uint64_t odd = 0;      ///< number of rays that hit the solid an odd number of times
    std::vector<OddRay> first;  ///< first Parity::kKept of the odd rays
};

/// Counts, over all bundles, the rays that hit each solid, and the rays that hit it an odd number
/// of times. A closed surface has no odd rays.
class Parity {
  public:
    static constexpr std::size_t kKept = 8;

    explicit Parity(const Solids& solids) : solids_(solids) {}

    /// Adds a band, which holds the keys in extra[0]. Bundles must be added in order.
    void add(std::size_t bundle, const LayeredImage& band);

    /// Returns the counts, by index of the solid. Solids without hits are absent.
    const std::map<std::uint32_t, SolidParity>& solids() const { return found_; }
    /// Returns the number of rays that hit at least one solid an odd number of times.
    std::uint64_t oddRays() const { return odd_rays_; }
    bool holds() const { return odd_rays_ == 0; }

  private:
    /// The storage of a thread, and the results of the rows that it processed.
    struct Scratch {
        SolidSpans spans;
        SparseSet<SolidParity> found;
    };
    static bool addRay(const SolidSpans& spans, std::span<const float> z, OddRay ray,
                       SparseSet<SolidParity>& found);

    const Solids& solids_;
    ObjectPool<Scratch> scratch_;
    std::map<std::uint32_t, SolidParity> found_;
    std::uint64_t odd_rays_ = 0;
};

}  // namespace peeler
