// SPDX-License-Identifier: Apache-2.0
// Which closed surface a hit belongs to, where a ray is inside of one, and whether rays leave what
// they enter.
#pragma once

#include <cstddef>
#include <cstdint>
#include <map>
#include <span>
#include <utility>
#include <vector>

#include <peeler/layered_image.h>
#include "core/base/parallel.h"
#include "core/base/sparse_set.h"
#include "core/scene/draw_list.h"
#include "core/scene/posed_scene.h"

namespace peeler {

/// A surface that is taken for the boundary of a body: what a ray enters it leaves again.
struct Solid {
    std::size_t instance = 0;  ///< index into PosedScene::meshes()
    int node = 0;
    std::span<const std::size_t> primitives{};  ///< of the mesh
    std::uint64_t triangles = 0;                ///< with three different corners
    std::uint64_t open_edges = 0;

    bool closed() const { return open_edges == 0; }
};

/// The solids of a scene. glTF does not say what is closed, so it follows from the topology:
/// vertices at the same position (bit for bit; −0 is 0) are one, and an edge is open if an odd
/// number of triangles has it. Every primitive of a mesh that is closed by itself is a solid; all
/// other triangles of the mesh together are one more, so a cube whose sides have different
/// materials is one solid. Lines and points belong to none. The topology of a mesh is found once
/// however often it stands in the scene, that of a deformed one for each deformation.
class Solids {
  public:
    static constexpr std::uint32_t kNone = 0xFFFFFFFFU;

    /// While the topology of a mesh is found, it takes some 30 bytes a triangle and 20 a vertex.
    explicit Solids(const PosedScene& posed);
    Solids(const Solids&) = delete;
    Solids& operator=(const Solids&) = delete;

    /// In draw order.
    const std::vector<Solid>& all() const { return solids_; }
    /// Index into all(), or kNone; of a key as DrawList counts them.
    std::uint32_t solidOf(std::uint32_t key) const { return surfaceOf(key).solid; }
    /// Index into Scene::materials.
    std::size_t materialOf(std::uint32_t key) const { return surfaceOf(key).material; }

  private:
    /// A primitive of an instance.
    struct Surface {
        std::uint32_t solid = kNone, material = 0;
    };
    /// What of a mesh will be a solid of every instance.
    struct Shell {
        std::vector<std::size_t> primitives;
        std::uint64_t triangles = 0, open_edges = 0;
    };

    const Surface& surfaceOf(std::uint32_t key) const { return surfaces_[keys_.surfaceOf(key)]; }
    class EdgeParity;
    const std::vector<Shell>& shellsOf(const PosedScene& posed, const MeshInstance& instance,
                                       EdgeParity& parity);

    std::vector<Solid> solids_;
    KeyIndex keys_;                  // of the draw list, which may end before
    std::vector<Surface> surfaces_;  // in its order
    std::map<std::pair<int, int>, std::vector<Shell>> shells_;  ///< by mesh and deformation
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
    std::uint32_t key = 0;    ///< of the hit that entered it
    std::uint32_t hit = 0;    ///< which of the ray's
};

/// How often a ray hits a solid.
struct SolidHits {
    std::uint32_t hits = 0;
    std::uint32_t last = 0;  ///< which of the ray's hits is its last one
    std::uint32_t span = 0;  ///< while its spans are found: the last one

    bool odd() const { return hits % 2 == 1; }
};

/// What the hits of a ray say of solids, by parity: the ray is inside of a solid from its 1st hit
/// to its 2nd, from its 3rd to its 4th, and so on; an odd last one opens nothing. Keeps its storage
/// from ray to ray: one for each thread.
class SolidSpans {
  public:
    /// `t` does not fall; `keys` as DrawList counts them, coincident hits in draw order.
    void find(std::span<const float> t, std::span<const std::uint32_t> keys, const Solids& solids);

    /// The spans that have a length, ordered by where they begin. Of several that begin together
    /// the longest is first, as if the others were inside of it.
    std::span<const SolidSpan> all() const { return spans_; }
    /// Every solid that is hit, and how often.
    const std::vector<SparseSet<SolidHits>::Entry>& hits() const { return hits_.entries(); }

  private:
    std::vector<SolidSpan> spans_;
    SparseSet<SolidHits> hits_;
};

/// The intervals inside at least one of the solids that `keep(span)` is true for, in order, without
/// gaps of no length between them. `out` is overwritten.
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
    int x = 0, y = 0;  ///< pixel of the bundle's picture
    float z = 0;       ///< camera Z of its last hit, which has no other one to go with
    bool operator==(const OddRay&) const = default;
};

struct SolidParity {
    std::uint64_t rays = 0;     ///< that hit it
    std::uint64_t odd = 0;      ///< of those
    std::vector<OddRay> first;  ///< the first Parity::kKept of the odd ones
};

/// Counts, over bundles, the rays that hit each solid, and those that hit it an odd number of
/// times: through a closed surface there are none.
class Parity {
  public:
    static constexpr std::size_t kKept = 8;

    explicit Parity(const Solids& solids) : solids_(solids) {}

    /// Bands of bundles in order. extra[0] are the keys.
    void add(std::size_t bundle, const LayeredImage& band);

    /// By index of the solid; those that no ray has hit are missing.
    const std::map<std::uint32_t, SolidParity>& solids() const { return found_; }
    std::uint64_t oddRays() const { return odd_rays_; }  ///< odd with any solid
    bool holds() const { return odd_rays_ == 0; }

  private:
    /// What a thread needs; what it finds of some rows.
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
