// SPDX-License-Identifier: Apache-2.0
// The area of a triangle that is not covered by any body in front of it.
#pragma once

#include <array>
#include <cstdint>
#include <glm/glm.hpp>
#include <utility>
#include <vector>

#include "core/parts/part_tree.h"
#include "core/parts/step_limit.h"

namespace peeler {

/// A calculation of the area of a triangle that other triangles leave uncovered. The other
/// triangles cross the plane of the triangle along lines. A ray gives the winding number in front
/// of one point of the triangle. The winding number changes by one across each line. If the winding
/// number at a point of a cell exceeds the number of lines through the cell, the whole cell is
/// covered. Otherwise, a cell with many lines is halved; a cell with few lines is cut into
/// trapezoids at every corner and crossing, which is exact up to rounding.
class FreeArea {
  public:
    /// Points within `near` (scene units) of a plane are taken to lie in it.
    FreeArea(const PartTree& tree, double near, StepLimit& limit)
        : tree_(tree), near_(near), limit_(limit) {}

    /// Returns the free area of a triangle, in square scene units. The result is meaningless if the
    /// limit was exceeded.
    double of(std::uint32_t triangle);

  private:
    using Polygon = std::vector<glm::dvec2>;  ///< corners of a convex polygon
    /// A segment along which another triangle crosses the plane. Across the segment, the winding
    /// number in front of the plane changes by one; the left side has the greater number.
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

    const PartTree& tree_;
    double near_;
    StepLimit& limit_;
    glm::dvec3 origin_{0}, normal_{0}, right_{0}, up_{0};
    Polygon own_;
    std::vector<Line> lines_;
    /// Coplanar triangles that are in front by the convention of add().
    std::vector<std::array<glm::dvec2, 3>> covers_;
    /// Scratch storage of freeLength(): the heights at which lines cross the vertical line at x,
    /// and the change of the winding number at each of them, going up.
    std::vector<std::pair<double, int>> steps_;
};

}  // namespace peeler
