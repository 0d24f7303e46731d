// SPDX-License-Identifier: Apache-2.0
// The triangles of a part in world space, corners at one place being one, and how they hang
// together.
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
    using Triangle = std::array<std::uint32_t, 3>;  ///< counter-clockwise on the front

    std::vector<glm::dvec3> points;
    std::vector<Triangle> triangles;  ///< with three different corners each
    std::uint64_t degenerate = 0;     ///< triangles left out because two corners are one

    std::array<glm::dvec3, 3> corners(std::size_t triangle) const {
        const Triangle& t = triangles[triangle];
        return {points[t[0]], points[t[1]], points[t[2]]};
    }
    /// Twice the area long, on the front.
    glm::dvec3 normal(std::size_t triangle) const {
        const auto [a, b, c] = corners(triangle);
        return glm::cross(b - a, c - a);
    }
    glm::dvec3 middle(std::size_t triangle) const {
        const auto [a, b, c] = corners(triangle);
        return (a + b + c) / 3.0;
    }
    /// How many corners two triangles have in common.
    int sharedCorners(std::size_t a, std::size_t b) const;
    /// The box around all points; nothing around none.
    Bounds bounds() const;
    /// The length of that box's diagonal.
    double size() const;
};

/// A mesh in its place. Vertices at the same position of the mesh (bit for bit; −0 is 0) are one
/// point, of whichever primitives. Lines and points are left out.
PartMesh partMesh(const PosedScene& posed, const MeshInstance& instance);

/// Several parts as one mesh. With `weld` points at the same place are one, across parts, too.
PartMesh joinParts(const std::vector<const PartMesh*>& parts, bool weld);

/// An edge between two points, the lesser first.
struct PartEdge {
    std::uint32_t a = 0, b = 0;
    bool operator==(const PartEdge&) const = default;
    bool operator<(const PartEdge& other) const {
        return std::tie(a, b) < std::tie(other.a, other.b);
    }
};

/// Triangles that hang together by edges which exactly two of them have.
struct PartShell {
    std::uint32_t first = 0;  ///< one of its triangles, the largest
    std::uint64_t triangles = 0;
    std::uint64_t open_edges = 0;
    bool orientable = true;
    double area = 0;
    /// Enclosed, of its triangles turned as most of them are; of an open one without meaning.
    double volume = 0;
};

/// How the triangles of a mesh hang together.
struct PartTopology {
    std::vector<PartEdge> open;     ///< of an odd number of triangles, mostly one
    std::vector<PartEdge> crowded;  ///< of more than two
    std::uint64_t holes = 0;        ///< groups of open edges that share points
    /// Triangles whose front faces the other way than that of most of their shell.
    std::vector<std::uint32_t> turned;
    std::vector<PartShell> shells;
    std::vector<std::uint32_t> shell_of;  ///< of each triangle
    /// Of each side of each triangle (from corner i to i + 1) the one triangle beyond it, or
    /// kNoTriangle.
    std::vector<std::array<std::uint32_t, 3>> beyond;

    bool closed() const { return open.empty(); }
};

PartTopology findTopology(const PartMesh& mesh);

}  // namespace peeler
