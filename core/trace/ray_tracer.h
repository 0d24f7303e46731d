// SPDX-License-Identifier: Apache-2.0
// All hits of any rays, exactly, without GL.
#pragma once

#include <array>
#include <bit>
#include <cstddef>
#include <cstdint>
#include <glm/glm.hpp>
#include <limits>
#include <span>
#include <vector>

#include <peeler/capture_settings.h>
#include "core/lens/picture_rays.h"
#include "core/raster/alpha_test.h"
#include "core/scene/draw_list.h"
#include "core/scene/posed_scene.h"
#include "core/trace/triangle_tree.h"

namespace peeler {

/// A hit as one number: the bits of t above the key (DrawList). The bits of positive floats sort
/// like the floats.
using SortedHit = std::uint64_t;

inline SortedHit sortedHit(float t, std::uint32_t key) {
    return SortedHit{std::bit_cast<std::uint32_t>(t)} << 32 | key;
}
inline float tOf(SortedHit hit) {
    return std::bit_cast<float>(static_cast<std::uint32_t>(hit >> 32));
}
inline std::uint32_t keyOf(SortedHit hit) {
    return static_cast<std::uint32_t>(hit);
}

/// The hits of some rays, in order.
struct HitList {
    std::vector<std::uint32_t> counts;  ///< by ray
    std::vector<SortedHit> hits;
};

/// The hits of a list of rays. Ray i has the hits offsets[i] to offsets[i + 1] − 1, in order of t;
/// at equal t in draw order.
struct RayHits {
    std::vector<std::uint64_t> offsets;
    std::vector<float> t;
    std::vector<std::uint32_t> keys;  ///< DrawList

    std::size_t rays() const { return offsets.empty() ? 0 : offsets.size() - 1; }
    std::size_t count(std::size_t ray) const {
        return static_cast<std::size_t>(offsets[ray + 1] - offsets[ray]);
    }
};

/// The settings that decide which intersections are hits (core/README.md, "What a fragment is").
struct TraceSettings {
    Faces faces = Faces::kGltf;
    double near = 0;  ///< t of the nearest hits, at least 0
    double far = std::numeric_limits<double>::infinity();
};

/// Finds all hits of rays of any origins and directions, in world space. The length of a direction
/// is the unit of t.
///
/// Vertices and rays are rounded to integers (CellGrid). Which triangles a ray hits is then decided
/// exactly, and the ray is moved symbolically so that it touches no edge. Every ray that begins
/// outside a closed surface hits it an even number of times. t is the exact quotient, rounded once
/// to a float. Results are bit-identical on every machine and for any number of threads
/// (README.md).
///
/// Triangles with a non-finite corner are not hit; neither are lines and points. Rays that are not
/// finite or have no direction hit nothing.
class RayTracer {
  public:
    /// Throws Error (kInput) if the scene has 2^31 triangles or vertices, or more.
    explicit RayTracer(PosedScene posed);

    /// Returns an estimate, from above, of the bytes that a RayTracer of a scene takes while it is
    /// built.
    static std::uint64_t mostBytes(const PosedScene& posed);

    static constexpr std::size_t kRaysOfPart = 1024;

    /// Finds the hits of rays, in parallel. Writes the hits of every kRaysOfPart successive rays to
    /// a part. Overwrites `parts`.
    void trace(std::span<const Ray> rays, const TraceSettings& settings,
               std::vector<HitList>& parts) const;
    /// Finds the hits of rays. Overwrites `hits`.
    void trace(std::span<const Ray> rays, const TraceSettings& settings, RayHits& hits) const;

    /// Returns the barycentric weights of a hit.
    std::array<double, 3> weightsAt(const Ray& ray, std::uint32_t key) const;

    const PosedScene& posed() const { return posed_; }
    const CellGrid& grid() const { return grid_; }
    std::size_t triangles() const { return triangles_.size(); }

  private:
    /// A triangle: its vertices and its key.
    struct Triangle {
        std::array<std::uint32_t, 3> vertex{};
        std::uint32_t key = 0;
    };
    /// The triangles of one instance of a primitive.
    struct Piece {
        const Primitive* primitive = nullptr;
        bool mirrored = false, double_sided = false;
        const AlphaTest* alpha = nullptr;  ///< null if there is no alpha test
        std::uint32_t first_key = 0;
    };
    struct GroupHit;
    struct Scratch;

    CellCorners cornersOf(const Triangle& triangle) const {
        return {vertices_[triangle.vertex[0]], vertices_[triangle.vertex[1]],
                vertices_[triangle.vertex[2]]};
    }
    const Piece& pieceOf(const Triangle& triangle) const {
        return pieces_[piece_of_.surfaceOf(triangle.key)];
    }
    bool isHit(const Piece& piece, const ExactRay& ray, const Triangle& triangle,
               const ExactHit& hit, const TraceSettings& settings) const;
    void traceRay(std::size_t index, const TraceSettings& settings, Scratch& scratch) const;
    bool tracePacket(std::size_t first, const TraceSettings& settings, Scratch& scratch) const;
    void traceGroup(std::span<const Ray> rays, const TraceSettings& settings, Scratch& scratch,
                    HitList& all) const;
    static void addSorted(std::size_t rays, Scratch& scratch, HitList& all);

    PosedScene posed_;
    CellGrid grid_;
    std::vector<AlphaTest> alpha_tests_;
    std::vector<Piece> pieces_;
    KeyIndex piece_of_;  ///< by key
    std::vector<Cells> vertices_;
    std::vector<Triangle> triangles_;
    TriangleTree tree_;
};

}  // namespace peeler
