// SPDX-License-Identifier: Apache-2.0
#include "core/parts/free_area.h"

#include <algorithm>
#include <cmath>
#include <limits>
#include <optional>

#include "core/base/cross.h"

namespace peeler {
namespace {

using Polygon = std::vector<glm::dvec2>;

constexpr double kFarAway = std::numeric_limits<double>::infinity();
constexpr double kLineSlack = 1e-12;  // tolerance for rounding, relative to a triangle's size
constexpr std::size_t kFewLines = 16;
constexpr int kMostHalvings = 64;

double areaOf(const Polygon& polygon) {
    double twice = 0;
    for (std::size_t i = 1; i + 1 < polygon.size(); ++i)
        twice += cross(polygon[i] - polygon[0], polygon[i + 1] - polygon[0]);
    return std::abs(twice) / 2;
}

std::pair<glm::dvec2, glm::dvec2> boxOf(const Polygon& polygon) {
    glm::dvec2 least = polygon[0], most = polygon[0];
    for (const glm::dvec2& p : polygon) {
        least = glm::min(least, p);
        most = glm::max(most, p);
    }
    return {least, most};
}

/// Returns the half of a polygon whose coordinate along `axis` is below `value` (side -1) or above
/// it (side 1).
Polygon halfOf(const Polygon& polygon, int axis, double value, double side) {
    Polygon half;
    for (std::size_t i = 0; i < polygon.size(); ++i) {
        const glm::dvec2 &p = polygon[i], &q = polygon[(i + 1) % polygon.size()];
        const double d = side * (p[axis] - value), e = side * (q[axis] - value);
        if (d >= 0) half.push_back(p);
        if ((d > 0 && e < 0) || (d < 0 && e > 0)) half.push_back(glm::mix(p, q, d / (d - e)));
    }
    return half;
}

/// Whether the segment pq passes through a convex polygon, not only along a side. Segments within
/// `slack` of a side are taken to run along it.
bool goesThrough(const glm::dvec2& p, const glm::dvec2& q, const Polygon& polygon, double slack) {
    int left = 0, right = 0;
    for (std::size_t i = 0; i < polygon.size(); ++i) {
        const glm::dvec2 side = polygon[(i + 1) % polygon.size()] - polygon[i];
        const double least = slack * glm::length(side);
        if (cross(side, p - polygon[i]) <= least && cross(side, q - polygon[i]) <= least)
            return false;
        const double beside = cross(q - p, polygon[i] - p);
        left += beside > 0 ? 1 : 0;
        right += beside < 0 ? 1 : 0;
    }
    return left > 0 && right > 0;
}

/// Returns the change of the winding number on the way from a to b, where segment ab crosses
/// segment pq; 0 if they do not cross.
int changeAt(const glm::dvec2& p, const glm::dvec2& q, const glm::dvec2& a, const glm::dvec2& b) {
    if ((cross(b - a, p - a) > 0) == (cross(b - a, q - a) > 0)) return 0;
    return (cross(q - p, b - p) > 0 ? 1 : 0) - (cross(q - p, a - p) > 0 ? 1 : 0);
}

std::optional<double> heightAt(const glm::dvec2& p, const glm::dvec2& q, double x) {
    if ((p.x > x) == (q.x > x)) return std::nullopt;
    return p.y + (q.y - p.y) * (x - p.x) / (q.x - p.x);
}

int windingAround(const std::array<glm::dvec2, 3>& corners, const glm::dvec2& at) {
    int left = 0;
    for (std::size_t i = 0; i < 3; ++i)
        left += cross(corners[(i + 1) % 3] - corners[i], at - corners[i]) > 0 ? 1 : 0;
    return left == 3 ? 1 : left == 0 ? -1 : 0;
}

double distanceTo(const glm::dvec2& p, const glm::dvec2& q, const glm::dvec2& at) {
    const glm::dvec2 along = q - p;
    const double square = glm::dot(along, along);
    const double share = square > 0 ? std::clamp(glm::dot(at - p, along) / square, 0.0, 1.0) : 0.0;
    return glm::length(at - p - share * along);
}

/// Returns a point inside a convex polygon, off the polygon's lines of symmetry.
glm::dvec2 oddMiddle(const Polygon& polygon) {
    glm::dvec2 sum(0);
    double weights = 0;
    for (const glm::dvec2& p : polygon) {
        const double weight = 1 + 0.37 * weights;
        sum += weight * p;
        weights += weight;
    }
    return sum / weights;
}

}  // namespace

double FreeArea::of(std::uint32_t triangle) {
    if (limit_.exceeded()) return 0;
    setPlane(tree_.mesh().corners(triangle));
    if (normal_ == glm::dvec3(0)) return 0;
    collect(triangle);
    return inCell(own_, lines_, firstPlace(), 0);
}

void FreeArea::setPlane(const std::array<glm::dvec3, 3>& corners) {
    const auto& [a, b, c] = corners;
    origin_ = a;
    normal_ = unitOrZero(glm::cross(b - a, c - a));
    right_ = unitOrZero(b - a);
    up_ = glm::cross(normal_, right_);
    own_ = {flat(a), flat(b), flat(c)};
}

void FreeArea::collect(std::uint32_t triangle) {
    lines_.clear();
    covers_.clear();
    const PartMesh& mesh = tree_.mesh();
    const Bounds box = grown(boundsOf(mesh.corners(triangle)), near_);
    tree_.visit([&](const Bounds& other) { return overlap(box, other); },
                [&](std::uint32_t s) {
                    if (s != triangle && overlap(box, boundsOf(mesh.corners(s))))
                        add(mesh.corners(s), s < triangle);
                });
    const double slack = kLineSlack * (glm::length(own_[1]) + glm::length(own_[2]));
    std::erase_if(lines_, [&](const Line& l) { return !goesThrough(l.p, l.q, own_, slack); });
}

void FreeArea::add(const std::array<glm::dvec3, 3>& other, bool before) {
    std::array<double, 3> d{};
    int above = 0, away = 0;
    for (std::size_t i = 0; i < 3; ++i) {
        d[i] = glm::dot(normal_, other[i] - origin_);
        above += d[i] > near_ ? 1 : 0;
        away += std::abs(d[i]) > near_ ? 1 : 0;
    }
    if (away == 0) {
        // Coplanar triangles follow a convention. If two triangles face the same way, the one with
        // the lower index is in front. If they face opposite ways, each is in front of the other,
        // as if there were a gap between their bodies.
        const glm::dvec3 facing = glm::cross(other[1] - other[0], other[2] - other[0]);
        if (glm::dot(facing, normal_) > 0 && !before) return;
        const std::array corners{flat(other[0]), flat(other[1]), flat(other[2])};
        for (std::size_t i = 0; i < 3; ++i)
            lines_.push_back({corners[i], corners[(i + 1) % 3]});
        covers_.push_back(corners);
        return;
    }
    if (above == 0 || above == 3) return;
    // The line is the segment where the other triangle crosses a plane just in front of this
    // triangle; so a corner within `near_` counts as below the plane. The segment begins at the
    // other triangle's side that descends through the plane and ends at the side that ascends. The
    // other triangle's body is then to the left of the segment.
    Line line{};
    for (std::size_t i = 0; i < 3; ++i) {
        const std::size_t k = (i + 1) % 3;
        const bool from_above = d[i] > near_;
        if (from_above == (d[k] > near_)) continue;
        const std::size_t low = from_above ? k : i, high = from_above ? i : k;
        const double share = std::clamp(-d[low] / (d[high] - d[low]), 0.0, 1.0);
        (from_above ? line.p : line.q) = flat(glm::mix(other[low], other[high], share));
    }
    lines_.push_back(line);
}

/// Returns a point of the triangle that is far from all lines, and the winding number at this
/// point.
FreeArea::Place FreeArea::firstPlace() const {
    constexpr std::array<glm::dvec2, 7> kShares{{{1 / 3.0, 1 / 3.0},
                                                 {0.47, 0.22},
                                                 {0.21, 0.46},
                                                 {0.31, 0.23},
                                                 {0.11, 0.17},
                                                 {0.71, 0.13},
                                                 {0.14, 0.69}}};
    Place place;
    double farthest = -1;
    for (const glm::dvec2& share : kShares) {
        const glm::dvec2 at = share.x * own_[1] + share.y * own_[2];
        double nearest = kFarAway;
        for (const Line& line : lines_)
            nearest = std::min(nearest, distanceTo(line.p, line.q, at));
        if (nearest <= farthest) continue;
        farthest = nearest;
        place.at = at;
    }
    place.winding =
        tree_.windingInFront(origin_ + place.at.x * right_ + place.at.y * up_, normal_, near_);
    for (const auto& cover : covers_)
        place.winding += windingAround(cover, place.at);
    return place;
}

/// Returns the point `at` with its winding number, given the point `from` of the same cell. `lines`
/// must include all lines that pass through the cell.
FreeArea::Place FreeArea::moved(const Place& from, const glm::dvec2& at,
                                const std::vector<Line>& lines) {
    Place to{at, from.winding};
    for (const Line& line : lines)
        to.winding += changeAt(line.p, line.q, from.at, at);
    return to;
}

double FreeArea::inCell(const Polygon& cell, const std::vector<Line>& lines, const Place& known,
                        int depth) {
    limit_.take(1 + lines.size());
    // The whole cell is covered, since the winding number cannot reach 0 in the cell.
    if (static_cast<std::size_t>(std::abs(known.winding)) > lines.size()) return 0;
    if (lines.empty()) return areaOf(cell);
    if (depth == kMostHalvings || limit_.exceeded()) return 0;
    if (lines.size() <= kFewLines) return inTrapezoids(cell, lines, known);
    const auto [least, most] = boxOf(cell);
    const int longer = most.x - least.x > most.y - least.y ? 0 : 1;
    for (const int axis : {longer, 1 - longer}) {
        std::array<Polygon, 2> halves;
        std::array<std::vector<Line>, 2> through;
        for (const std::size_t i : {0U, 1U}) {
            halves[i] = halfOf(cell, axis, (least[axis] + most[axis]) / 2, i == 0 ? -1 : 1);
            for (const Line& line : lines)
                if (goesThrough(line.p, line.q, halves[i], 0)) through[i].push_back(line);
        }
        // Halving along this axis is useless if most lines (coincident lines, for example) pass
        // through both halves.
        if (4 * (through[0].size() + through[1].size()) > 7 * lines.size()) continue;
        double area = 0;
        for (const std::size_t i : {0U, 1U})
            if (halves[i].size() > 2)
                area += inCell(halves[i], through[i], moved(known, oddMiddle(halves[i]), lines),
                               depth + 1);
        return area;
    }
    return inTrapezoids(cell, lines, known);
}

double FreeArea::inTrapezoids(const Polygon& cell, const std::vector<Line>& lines,
                              const Place& known) {
    const auto [least, most] = boxOf(cell);
    std::vector<Line> edges = lines;
    for (std::size_t i = 0; i < cell.size(); ++i)
        edges.push_back({cell[i], cell[(i + 1) % cell.size()]});
    std::vector<double> cuts;
    for (std::size_t i = 0; i < edges.size(); ++i) {
        const auto& [p, q] = edges[i];
        cuts.insert(cuts.end(), {p.x, q.x});
        for (std::size_t k = i + 1; k < edges.size(); ++k) {
            const glm::dvec2 v = edges[k].q - edges[k].p, to = edges[k].p - p;
            const double across = cross(q - p, v);
            if (across == 0) continue;
            const double s = cross(to, v) / across, t = cross(to, q - p) / across;
            if (s >= 0 && s <= 1 && t >= 0 && t <= 1) cuts.push_back(p.x + s * (q.x - p.x));
        }
    }
    std::erase_if(
        cuts, [left = least.x, right = most.x](double x) { return !(x >= left && x <= right); });
    std::sort(cuts.begin(), cuts.end());
    limit_.take(lines.size() * (lines.size() + cuts.size()));
    const double narrow = kLineSlack * (most.x - least.x);
    double area = 0;
    for (std::size_t i = 0; i + 1 < cuts.size() && !limit_.exceeded(); ++i) {
        const double width = cuts[i + 1] - cuts[i];
        if (width > narrow)
            area += width * freeLength(cell, lines, known, (cuts[i] + cuts[i + 1]) / 2);
    }
    return area;
}

/// Returns the free length of a cell's section at this x. Lines must not end or cross in the
/// section.
double FreeArea::freeLength(const Polygon& cell, const std::vector<Line>& lines, const Place& known,
                            double x) {
    double low = kFarAway, high = -kFarAway;
    for (std::size_t i = 0; i < cell.size(); ++i) {
        if (const auto y = heightAt(cell[i], cell[(i + 1) % cell.size()], x)) {
            low = std::min(low, *y);
            high = std::max(high, *y);
        }
    }
    if (!(high > low)) return 0;
    steps_.assign(1, {low, 0});
    for (const auto& [p, q] : lines)
        if (const auto y = heightAt(p, q, x); y && *y > low && *y < high)
            steps_.emplace_back(*y, p.x < q.x ? 1 : -1);
    steps_.emplace_back(high, 0);
    std::sort(steps_.begin(), steps_.end());
    // Begins in the middle of the longest interval, where the winding number is most reliable.
    const auto lengthOf = [&](std::size_t i) { return steps_[i + 1].first - steps_[i].first; };
    std::size_t longest = 0;
    for (std::size_t i = 1; i + 1 < steps_.size(); ++i)
        if (lengthOf(i) > lengthOf(longest)) longest = i;
    const double y = (steps_[longest].first + steps_[longest + 1].first) / 2;
    int winding = moved(known, {x, y}, lines).winding;
    for (std::size_t i = longest; i > 0; --i)
        winding -= steps_[i].second;
    double free = 0;
    for (std::size_t i = 0; i + 1 < steps_.size(); ++i) {
        winding += steps_[i].second;
        if (winding == 0) free += lengthOf(i);
    }
    return free;
}

}  // namespace peeler
