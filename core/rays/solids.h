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

/// The directions in which the rays of some bundles cross triangles: into or out of the solid. All
/// rays that are parallel or begin at one point cross a triangle in the same direction, which is
/// computed on first use, for all bundles at once. Thread-safe.
class TriangleSides {
  public:
    static constexpr std::size_t kMostBundles = 7;

    TriangleSides(const PosedScene& posed, std::span<const Bundle> bundles);

    /// Whether turn() needs the ray.
    bool needRay() const { return sides_.empty(); }
    /// Returns 1 if rays of a bundle (an index) enter through the triangle of a key, −1 if they
    /// leave. `ray` may be null unless needRay().
    int turn(std::uint32_t key, const Ray* ray = nullptr, std::size_t bundle = 0) const {
        if (needRay()) return turnOf(key, ray->direction);
        const std::atomic_ref side(sides_[key]);
        std::uint8_t known = side.load(std::memory_order_relaxed);
        if (known == 0) side.store(known = find(key), std::memory_order_relaxed);
        return 1 - 2 * (known >> bundle & 1);
    }
    /// Returns the bytes that the sides of a scene take.
    static std::uint64_t bytes(const PosedScene& posed);

  private:
    /// The triangles of one primitive of one instance.
    struct Surface {
        const Primitive* primitive = nullptr;
        const glm::vec3* positions = nullptr;
        const MeshInstance* instance = nullptr;
        std::uint32_t first_key = 0, triangles = 0;
    };
    /// The direction of a bundle's rays or, if they are not parallel, their origin.
    struct Way {
        bool parallel = false;
        glm::dvec3 at{0};
    };
    /// A triangle's first corner and its normal (WorldElement::normal()), world space.
    struct Plane {
        glm::dvec3 corner, normal;
    };

    static Plane planeOf(const Surface& surface, std::uint32_t element);
    std::uint8_t find(std::uint32_t key) const;
    int turnOf(std::uint32_t key, const glm::dvec3& direction) const;

    PosedScene posed_;
    const KeyIndex* keys_;
    std::vector<Surface> surfaces_;  ///< one for each surface of keys_
    std::vector<Way> ways_;          ///< one for each bundle
    /// By key: bit i says whether the rays of bundle i leave. Bit kMostBundles is set; 0 means not
    /// found yet.
    mutable std::vector<std::uint8_t> sides_;
};

/// The solids of a scene. glTF does not mark closed surfaces, so the topology decides. Vertices at
/// the same position (bit for bit; −0 is 0) are welded, and an edge is open if an odd number of
/// triangles share it. Edges are compared by hashes of 64 bits. Every primitive of a mesh that is
/// closed by itself is a solid. All other primitives of the mesh together form one more solid, so a
/// cube with different materials on its sides is one solid. Lines and points belong to no solid.
/// The topology of a mesh is found once for all its instances, and once for each deformation.
class Solids {
  public:
    static constexpr std::uint32_t kNone = 0xFFFFFFFFU;

    /// Temporarily takes 8 bytes per vertex of a primitive to find its topology and, to count open
    /// edges, about 50 bytes per triangle.
    explicit Solids(const PosedScene& posed);
    Solids(const Solids&) = delete;
    Solids& operator=(const Solids&) = delete;

    /// Returns the solids in draw order.
    const std::vector<Solid>& all() const { return solids_; }
    /// Returns the solid of a key (DrawList): an index into all(), or kNone.
    std::uint32_t solidOf(std::uint32_t key) const { return surfaceOf(key).solid; }
    /// Returns the sides of triangles; nullopt if the rule needs no sides.
    std::optional<TriangleSides> sides(std::span<const Bundle> bundles, Overlap overlap) const;
    /// Returns the bytes of sides().
    std::uint64_t sidesBytes(Overlap overlap) const;
    /// Returns the material of a key: an index into Scene::materials.
    std::size_t materialOf(std::uint32_t key) const { return surfaceOf(key).material; }

    /// The solid and the material of one primitive of one instance.
    struct Surface {
        std::uint32_t solid = kNone, material = 0;
        bool winds = false;  ///< Solid::winds()
    };
    const Surface& surfaceOf(std::uint32_t key) const { return surfaces_[keys_.surfaceOf(key)]; }

  private:
    /// The part of a mesh that becomes one solid in each instance of the mesh.
    struct Shell {
        std::vector<std::size_t> primitives;
        std::uint64_t triangles = 0, open_edges = 0;
        SolidFacing facing = SolidFacing::kMixed;
    };

    const std::vector<Shell>& shellsOf(const PosedScene& posed, const MeshInstance& instance);

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
    /// Prepares rays of a bundle: finds the solids that their hits cross. `keys` are those of
    /// DrawList, ray after ray, ordered by t, with coincident hits in draw order. `sides`:
    /// Solids::sides() of several bundles, or null. `bundle` is an index into them. `ray` may be
    /// null unless the sides need it. Parity replaces winding numbers if `sides` is null, for
    /// solids that do not face outwards, and for solids that a ray does not leave as often as it
    /// enters them (because it grazes triangles).
    void prepare(std::span<const std::uint32_t> keys, const Solids& solids,
                 const TriangleSides* sides = nullptr, const Ray* ray = nullptr,
                 std::size_t bundle = 0);
    /// Begins the ray with the hits from `first` on of those prepared. Returns false if the ray
    /// crosses the same solids in the same order as the ray before, so that hits() is the same.
    bool begin(std::size_t first, std::size_t count);
    /// Finds all() of the ray.
    void place(std::span<const float> t, std::span<const std::uint32_t> keys);
    /// Prepares, begins and places a ray.
    void find(std::span<const float> t, std::span<const std::uint32_t> keys, const Solids& solids,
              const TriangleSides* sides = nullptr, const Ray* ray = nullptr) {
        prepare(keys, solids, sides, ray);
        begin(0, keys.size());
        place(t, keys);
    }

    /// Returns the spans of non-zero length, ordered by their beginnings. If several spans begin
    /// together, the longest is first, so that the others are inside it. Valid after place().
    std::span<const SolidSpan> all() const { return spans_; }
    /// Returns every solid that the ray hits, with the hit count.
    const std::vector<SparseSet<SolidHits>::Entry>& hits() const { return hits_.entries(); }
    /// Calls use(interval) with the union of all spans, as ordered intervals of non-zero length
    /// that do not touch. `t` is that of the ray's hits.
    template <class Use>
    void forEachInside(std::span<const float> t, Use&& use) const {
        for (std::size_t i = 0; i < outer_.size();) {
            RayInterval inside{t[outer_[i].begin], t[outer_[i].end]};
            for (++i; i < outer_.size() && t[outer_[i].begin] <= inside.end; ++i)
                inside.end = t[outer_[i].end];
            if (inside.end > inside.begin) use(inside);
        }
    }

  private:
    /// A span, by the indices of the hits at which it begins and ends.
    struct HitSpan {
        std::uint32_t begin = 0, end = 0, solid = 0;
    };
    /// A hit's solid and turn (TriangleSides). The turn is 0 if parity decides.
    struct Crossing {
        std::uint32_t solid = Solids::kNone;
        std::int32_t turn = 0;
        bool operator==(const Crossing&) const = default;
    };

    void findHitSpans();

    std::vector<Crossing> prepared_;
    std::size_t solids_ = 0;           ///< number of solids
    std::vector<Crossing> crossings_;  ///< of the ray's hits
    std::vector<HitSpan> hit_spans_;
    std::vector<HitSpan> outer_;  ///< union of hit_spans_; `solid` has no meaning
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
        bool add(std::span<const float> z, std::size_t first, OddRay ray);
        void endRun();

        SolidSpans spans;
        SparseSet<SolidParity> found;
        std::uint64_t run = 0;           ///< number of latest rays that cross the same solids
        std::vector<std::uint32_t> hit;  ///< these solids
        bool odd = false;                ///< whether a solid is hit an odd number of times
    };

    const Solids& solids_;
    ObjectPool<Scratch> scratch_;
    std::map<std::uint32_t, SolidParity> found_;
    std::uint64_t odd_rays_ = 0;
};

}  // namespace peeler
