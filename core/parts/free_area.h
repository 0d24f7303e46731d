// SPDX-License-Identifier: Apache-2.0
// The area of a triangle not covered by a body in front of it.
#pragma once

#include <array>
#include <cstdint>
#include <glm/glm.hpp>
#include <utility>
#include <vector>

#include "core/parts/step_limit.h"
#include "core/parts/triangle_tree.h"

namespace peeler {

/// Finds free areas in the arrangement of the lines along which other triangles cross the plane of
/// one. A ray gives the winding number in front of one point; on the way to any other point it
/// changes by one at each line. A cell with a greater winding number than lines is covered. A cell
/// with many lines is halved; a cell with few is cut into trapezoids at every corner and crossing,
/// which is exact up to rounding.
class FreeArea {
  public:
    /// Points within `near` (scene units) of a plane lie in it.
    FreeArea(const TriangleTree& tree, double near, StepLimit& limit)
        : tree_(tree), near_(near), limit_(limit) {}

    /// Returns scene units squared; meaningless once the limit is exceeded.
    double of(std::uint32_t triangle);

  private:
    using Polygon = std::vector<glm::dvec2>;  ///< convex
    /// The winding number in front is greater by one on its left.
    struct Line {
        glm::dvec2 p, q;
    };
    struct Place {
        glm::dvec2 at{0};
        int winding = 0;
    };

    void setPlane(const std::array<glm::dvec3, 3>& corners);
    glm::dvec2 flat(const glm::dvec3& p) const {
        return {glm::dot(p - origin_, right_), glm::dot(p - origin_, up_)};
    }
    void collect(std::uint32_t triangle);
    void add(const std::array<glm::dvec3, 3>& other, bool before);
    Place firstPlace() const;
    static Place moved(const Place& from, const glm::dvec2& at, const std::vector<Line>& lines);

    double inCell(const Polygon& cell, const std::vector<Line>& lines, const Place& known,
                  int depth);
    double inTrapezoids(const Polygon& cell, const std::vector<Line>& lines, const Place& known);
    double freeLength(const Polygon& cell, const std::vector<Line>& lines, const Place& known,
                      double x);

    const TriangleTree& tree_;
    double near_;
    StepLimit& limit_;
    glm::dvec3 origin_{0}, normal_{0}, right_{0}, up_{0};
    Polygon own_;
    std::vector<Line> lines_;
    /// Triangles in the plane of this one that count as in front of it, by convention.
    std::vector<std::array<glm::dvec2, 3>> covers_;
    /// Heights of the lines at one x, and the change of the winding number there, upwards.
    std::vector<std::pair<double, int>> steps_;
};

}  // namespace peeler
