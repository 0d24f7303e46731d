// SPDX-License-Identifier: Apache-2.0
// A bounding volume hierarchy of triangles in double precision, and line queries.
#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <glm/glm.hpp>
#include <optional>
#include <vector>

#include "core/parts/part_mesh.h"

namespace peeler {

inline bool overlap(const Bounds& a, const Bounds& b) {
    return a.min.x <= b.max.x && b.min.x <= a.max.x && a.min.y <= b.max.y && b.min.y <= a.max.y &&
           a.min.z <= b.max.z && b.min.z <= a.max.z;
}

inline Bounds grown(const Bounds& box, double margin) {
    return {box.min - margin, box.max + margin};
}

Bounds boundsOf(const std::array<glm::dvec3, 3>& corners);

/// Intersection of a line and a triangle.
struct LineHit {
    double t = 0;
    std::uint32_t triangle = 0;
    bool leaves = false;  ///< whether the line passes from the triangle's back to its front
    /// Whether the hit is exactly on an edge; the line may then also hit the neighbouring triangle.
    bool on_edge = false;
};

/// A line, parametrised by t from its origin. The intersection test is watertight: a line that
/// passes near a shared edge, but not through it, hits exactly one of the two triangles (Woop,
/// Benthin and Wald 2013, "Watertight Ray/Triangle Intersection", section 3.2).
class CheckedLine {
  public:
    CheckedLine(const glm::dvec3& origin, const glm::dvec3& direction);

    /// Whether the line meets the box at any t in [from, to].
    bool meets(const Bounds& box, double from, double to) const;
    std::optional<LineHit> meets(const std::array<glm::dvec3, 3>& corners) const;

    glm::dvec3 at(double t) const { return origin_ + t * direction_; }
    const glm::dvec3& direction() const { return direction_; }

  private:
    glm::dvec3 origin_, direction_, inverse_;
    int x_ = 0, y_ = 1, z_ = 2;
    glm::dvec3 shear_;
};

/// A bounding volume hierarchy of a mesh's triangles. Nodes are split at the median of the triangle
/// centres, down to four triangles per leaf.
class PartTree {
  public:
    /// The mesh must outlive the tree.
    explicit PartTree(const PartMesh& mesh);

    /// Calls visit(triangle) for every triangle in a box for which enter(box) is true.
    template <class Enter, class Visit>
    void visit(Enter&& enter, Visit&& visit) const {
        if (nodes_.empty()) return;
        std::array<std::uint32_t, 64> stack{};
        std::size_t left = 1;
        while (left > 0) {
            const Node& node = nodes_[stack[--left]];
            if (!enter(node.box)) continue;
            if (node.count == 0) {
                stack[left++] = node.first;
                stack[left++] = node.first + 1;
                continue;
            }
            for (std::uint32_t i = 0; i < node.count; ++i)
                visit(order_[node.first + i]);
        }
    }

    const PartMesh& mesh() const { return mesh_; }

    /// Returns the winding number of the point just in front of a surface: the number of bodies
    /// around the point, each counted once per winding of its surface. Follows a ray toward the
    /// side of `normal`, and counts the surfaces that the ray leaves minus the surfaces that it
    /// enters. Ignores triangles within `near` of the point, because they belong to the surface
    /// itself.
    int windingInFront(const glm::dvec3& point, const glm::dvec3& normal, double near) const;

  private:
    struct Node {
        Bounds box;
        /// For a leaf: index into order_. For an inner node: index of the first of its two
        /// children.
        std::uint32_t first = 0;
        std::uint32_t count = 0;  ///< number of triangles of a leaf; 0 for inner nodes
    };
    void build(std::uint32_t node, std::uint32_t begin, std::uint32_t end,
               const std::vector<Bounds>& boxes);

    const PartMesh& mesh_;
    std::vector<Node> nodes_;
    std::vector<std::uint32_t> order_;
};

}  // namespace peeler
