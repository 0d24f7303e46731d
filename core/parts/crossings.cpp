// SPDX-License-Identifier: Apache-2.0
// Intersections between the triangles of a mesh.
#include "core/parts/crossings.h"

#include <algorithm>
#include <array>
#include <atomic>
#include <cmath>
#include <limits>

#include "core/parts/step_limit.h"

namespace peeler {
namespace {

using Corners3 = std::array<glm::dvec3, 3>;
using Distances = std::array<double, 3>;

/// Returns the unit normal; 0 for a degenerate triangle.
glm::dvec3 unitNormal(const Corners3& t) {
    return unitOrZero(glm::cross(t[1] - t[0], t[2] - t[0]));
}

/// Returns the signed distances of the corners from a plane. Distances up to `near` become 0.
Distances distancesFrom(const glm::dvec3& point, const glm::dvec3& normal, const Corners3& t,
                        double near) {
    Distances d{};
    for (std::size_t i = 0; i < 3; ++i) {
        d[i] = glm::dot(normal, t[i] - point);
        if (std::abs(d[i]) <= near) d[i] = 0;
    }
    return d;
}

bool allOnOneSide(const Distances& d) {
    return (d[0] > 0 && d[1] > 0 && d[2] > 0) || (d[0] < 0 && d[1] < 0 && d[2] < 0);
}
bool onBothSides(const Distances& d) {
    return std::max({d[0], d[1], d[2]}) > 0 && std::min({d[0], d[1], d[2]}) < 0;
}

struct Interval {
    double begin = std::numeric_limits<double>::infinity();
    double end = -std::numeric_limits<double>::infinity();

    void add(double x) {
        begin = std::min(begin, x);
        end = std::max(end, x);
    }
};

/// A segment of a line, and its interval along the line.
struct Cut {
    Interval x;
    Segment ends{};

    void add(const glm::dvec3& point, const glm::dvec3& along) {
        const double at = glm::dot(along, point);
        if (at < x.begin) ends[0] = point;
        if (at > x.end) ends[1] = point;
        x.add(at);
    }
};

/// Returns the intersection of a triangle with a plane, in the direction `along`. `d` holds the
/// corners' distances from the plane.
Cut cut(const Corners3& t, const Distances& d, const glm::dvec3& along) {
    Cut cut;
    for (std::size_t i = 0; i < 3; ++i) {
        const std::size_t k = (i + 1) % 3;
        if (d[i] == 0) cut.add(t[i], along);
        if (d[i] * d[k] < 0) cut.add(glm::mix(t[i], t[k], d[i] / (d[i] - d[k])), along);
    }
    return cut;
}

/// Returns the gap between two coplanar triangles: the largest gap along the normal of any of their
/// edges. The gap is negative if the triangles overlap.
double planarGap(const Corners3& a, const Corners3& b, const glm::dvec3& normal) {
    double gap = -std::numeric_limits<double>::infinity();
    for (const Corners3* t : {&a, &b}) {
        for (std::size_t i = 0; i < 3; ++i) {
            const glm::dvec3 out = unitOrZero(glm::cross((*t)[(i + 1) % 3] - (*t)[i], normal));
            Interval x, y;
            for (std::size_t k = 0; k < 3; ++k) {
                x.add(glm::dot(out, a[k]));
                y.add(glm::dot(out, b[k]));
            }
            gap = std::max(gap, std::max(x.begin - y.end, y.begin - x.end));
        }
    }
    return gap;
}

Meeting planarMeeting(const Corners3& a, const Corners3& b, int shared, double near) {
    const glm::dvec3 na = unitNormal(a), nb = unitNormal(b);
    const double gap = planarGap(a, b, na);
    if (gap > near) return Meeting::kApart;
    if (gap >= -near) return shared > 0 ? Meeting::kApart : Meeting::kTouch;
    // Faces of two bodies in contact overlap and look in opposite directions. If opposite faces
    // share a corner, the surface is folded onto itself instead.
    if (glm::dot(na, nb) < 0 && shared == 0) return Meeting::kTouch;
    return Meeting::kCross;
}

}  // namespace

Meeting meetingOf(const Corners3& a, const Corners3& b, int shared, double near) {
    const glm::dvec3 na = unitNormal(a), nb = unitNormal(b);
    if (na == glm::dvec3(0) || nb == glm::dvec3(0)) return Meeting::kApart;
    const Distances db = distancesFrom(a[0], na, b, near);
    if (allOnOneSide(db)) return Meeting::kApart;
    const Distances da = distancesFrom(b[0], nb, a, near);
    if (allOnOneSide(da)) return Meeting::kApart;
    const bool flat = db == Distances{} || da == Distances{};
    if (flat) {
        // If only one of the triangles lies in the other's plane, one of the two is a sliver, whose
        // plane is arbitrary. Slivers do not count as crossing.
        if (db != Distances{} || da != Distances{})
            return shared > 0 ? Meeting::kApart : Meeting::kTouch;
        return planarMeeting(a, b, shared, near);
    }
    const glm::dvec3 line = unitOrZero(glm::cross(na, nb));
    if (line == glm::dvec3(0)) return Meeting::kApart;
    const Interval x = cut(a, da, line).x, y = cut(b, db, line).x;
    const double common = std::min(x.end, y.end) - std::max(x.begin, y.begin);
    if (common < -near) return Meeting::kApart;
    if (common > near && onBothSides(da) && onBothSides(db)) return Meeting::kCross;
    return shared > 0 ? Meeting::kApart : Meeting::kTouch;
}

std::optional<Segment> crossingSegment(const Corners3& a, const Corners3& b, double near) {
    const glm::dvec3 na = unitNormal(a), nb = unitNormal(b);
    const Distances da = distancesFrom(b[0], nb, a, near), db = distancesFrom(a[0], na, b, near);
    if (!onBothSides(da) || !onBothSides(db)) return std::nullopt;
    const glm::dvec3 line = unitOrZero(glm::cross(na, nb));
    const Cut x = cut(a, da, line), y = cut(b, db, line);
    return Segment{(x.x.begin > y.x.begin ? x : y).ends[0], (x.x.end < y.x.end ? x : y).ends[1]};
}

namespace {

constexpr std::size_t kCrossedAtOnce = 64;
/// The step limit of findCrossings() is kCrossingSteps, plus kCrossingStepsPerTriangle for each
/// triangle. A comparison of two triangles takes one step; storing a pair takes
/// kCrossingStepsPerPair steps.
constexpr std::uint64_t kCrossingSteps = 20'000'000, kCrossingStepsPerTriangle = 100,
                        kCrossingStepsPerPair = 10;
constexpr std::uint64_t kFirstCrossingSteps = 1'000'000;

/// Calls visit(other, meeting) for each triangle with index `first` or greater that touches or
/// crosses `triangle`. Returns the number of comparisons.
template <class Visit>
std::uint64_t visitMeetings(const PartTree& tree, double near, std::uint32_t triangle,
                            std::uint32_t first, Visit&& visit) {
    const PartMesh& mesh = tree.mesh();
    const Corners3 corners = mesh.corners(triangle);
    const Bounds box = grown(boundsOf(corners), near);
    std::uint64_t compared = 0;
    tree.visit([&](const Bounds& other) { return overlap(box, other); },
               [&](std::uint32_t s) {
                   if (s < first || s == triangle) return;
                   const Corners3 others = mesh.corners(s);
                   if (!overlap(box, boundsOf(others))) return;
                   const int shared = mesh.sharedCorners(triangle, s);
                   // a duplicate triangle; its edges are reported as crowded
                   if (shared == 3) return;
                   ++compared;
                   const Meeting meeting = meetingOf(corners, others, shared, near);
                   if (meeting != Meeting::kApart) visit(s, meeting);
               });
    return compared;
}

}  // namespace

Crossings findCrossings(const PartTree& tree, const Progress& progress) {
    const std::size_t count = tree.mesh().triangles.size();
    const double near = kTouching * tree.mesh().size();
    Crossings found;
    found.touched.resize(count);
    const auto find = [&](std::size_t triangle, std::vector<CrossingPair>& pairs,
                          StepLimit& limit) {
        const auto t = static_cast<std::uint32_t>(triangle);
        const std::size_t before = pairs.size();
        const std::uint64_t compared =
            visitMeetings(tree, near, t, t + 1, [&](std::uint32_t s, Meeting meeting) {
                for (const std::uint32_t touched : {t, s})
                    std::atomic_ref(found.touched[touched]).store(1, std::memory_order_relaxed);
                if (meeting == Meeting::kCross) pairs.emplace_back(t, s);
            });
        limit.take(compared + kCrossingStepsPerPair * (pairs.size() - before));
    };
    std::vector<std::vector<CrossingPair>> shares((count + kCrossedAtOnce - 1) / kCrossedAtOnce);
    StepLimit limit(kCrossingSteps + kCrossingStepsPerTriangle * count);
    found.more = !parallelFor(shares.size(), limit, progress, [&](std::size_t i) {
        const std::size_t end = std::min((i + 1) * kCrossedAtOnce, count);
        for (std::size_t t = i * kCrossedAtOnce; t < end && !limit.exceeded(); ++t)
            find(t, shares[i], limit);
    });
    if (found.more) {
        // Thread timing decides which pairs are found before the limit is reached. To make the
        // result repeatable, the first pairs are found again on one thread.
        StepLimit first(kFirstCrossingSteps);
        for (std::size_t t = 0; t < count && !first.exceeded(); ++t)
            find(t, found.pairs, first);
    } else {
        for (const auto& share : shares)
            found.pairs.insert(found.pairs.end(), share.begin(), share.end());
    }
    std::sort(found.pairs.begin(), found.pairs.end());
    return found;
}

std::vector<char> crossedTriangles(const Crossings& crossings) {
    std::vector<char> crossed(crossings.touched.size());
    for (const auto& [a, b] : crossings.pairs)
        crossed[a] = crossed[b] = 1;
    return crossed;
}

glm::dvec3 CrossingCurve::middle(const CrossingPair& pair) const {
    const std::optional<Segment> ends = segment(pair);
    return ends ? ((*ends)[0] + (*ends)[1]) / 2.0 : mesh_.middle(pair.first);
}

double CrossingCurve::length(const std::vector<CrossingPair>& pairs) const {
    double sum = 0;
    for (const CrossingPair& pair : pairs)
        if (const auto ends = segment(pair)) sum += glm::distance((*ends)[0], (*ends)[1]);
    return sum;
}

}  // namespace peeler
