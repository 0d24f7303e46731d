// SPDX-License-Identifier: Apache-2.0
// The welded triangle mesh of a part in world space, and its topology.
#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <glm/glm.hpp>
#include <limits>
#include <tuple>
#include <vector>

#include "core/scene/posed_scene.h"

namespace peeler {

inline constexpr std::uint32_t kNoTriangle = std::numeric_limits<std::uint32_t>::max();

/// Triangles without materials, in double precision and world space.
struct PartMesh {
    /// Corners, counter-clockwise as seen from the front.
    using Triangle = std::array<std::uint32_t, 3>;

    std::vector<glm::dvec3> points;
    std::vector<Triangle> triangles;  ///< triangles with three different corners
    std::uint64_t degenerate = 0;  ///< number of omitted triangles, which have coincident corners

    std::array<glm::dvec3, 3> corners(std::size_t triangle) const {
        const Triangle& t = triangles[triangle];
        return {points[t[0]], points[t[1]], points[t[2]]};
    }
    /// Returns the front-facing normal; its length is twice the area.
    glm::dvec3 normal(std::size_t triangle) const {
        const auto [a, b, c] = corners(triangle);
        return glm::cross(b - a, c - a);
    }
    glm::dvec3 middle(std::size_t triangle) const {
        const auto [a, b, c] = corners(triangle);
        return (a + b + c) / 3.0;
    }
    /// Returns the number of corners that two triangles share.
    int sharedCorners(std::size_t a, std::size_t b) const;
    /// Returns the bounding box of all points; empty if there are no points.
    Bounds bounds() const;
    /// Returns the length of the diagonal of bounds().
    double size() const;
};

/// Returns a mesh in world space. Vertices with the same position in the mesh (bit for bit; −0 is
/// 0) become one point, even across primitives. Lines and points are omitted.
PartMesh partMesh(const PosedScene& posed, const MeshInstance& instance);

/// Joins several parts into one mesh. If `weld`, merges points with the same position, even across
/// parts.
PartMesh joinParts(const std::vector<const PartMesh*>& parts, bool weld);

/// An edge between two points, smaller index first.
struct PartEdge {
    std::uint32_t a = 0, b = 0;
    bool operator==(const PartEdge&) const = default;
    bool operator<(const PartEdge& other) const {
        return std::tie(a, b) < std::tie(other.a, other.b);
    }
};

/// Returns the points of some edges, in ascending order.
std::vector<std::uint32_t> pointsOf(const std::vector<PartEdge>& edges);

/// Returns the mesh after merging points of `candidates` (in ascending order). Each candidate is
/// merged with the first kept candidate within `tolerance` (scene units, above 0); if there is no
/// such candidate, it is kept. Triangles with two merged corners count as degenerate.
PartMesh weldPoints(const PartMesh& mesh, const std::vector<std::uint32_t>& candidates,
                    double tolerance);

/// A shell: triangles connected by edges that exactly two triangles share.
struct PartShell {
    std::uint32_t first = 0;  ///< index of the shell's largest triangle
    std::uint64_t triangles = 0;
    std::uint64_t open_edges = 0;
    bool orientable = true;
    double area = 0;
    /// Signed volume, in cubic scene units, after flipping the triangles that face against the
    /// majority. Positive if the majority faces outwards; meaningless if the shell is open.
    double volume = 0;
};

struct PartTopology {
    std::vector<PartEdge> open;  ///< edges that belong to an odd number of triangles, usually one
    std::vector<PartEdge> crowded;  ///< edges that belong to more than two triangles
    std::uint64_t holes = 0;        ///< number of groups of open edges that share points
    /// Triangles that face against the majority of their shell.
    std::vector<std::uint32_t> turned;
    std::vector<PartShell> shells;
    std::vector<std::uint32_t> shell_of;  ///< index of each triangle's shell
    /// For each side of each triangle (from corner i to i + 1): the triangle across the side;
    /// kNoTriangle unless exactly one triangle is there.
    std::vector<std::array<std::uint32_t, 3>> beyond;

    bool closed() const { return open.empty(); }
};

PartTopology findTopology(const PartMesh& mesh);

}  // namespace peeler
