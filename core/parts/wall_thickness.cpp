// SPDX-License-Identifier: Apache-2.0
// The thinnest wall of a part. Rays from every triangle give an upper bound. Then every pair of
// faces that could be closer than the bound is tested.
#include "core/parts/wall_thickness.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <limits>
#include <mutex>
#include <numbers>
#include <tuple>

#include "core/parts/crossings.h"
#include "core/parts/step_limit.h"

namespace peeler {
namespace {

constexpr std::size_t kWallsAtOnce = 512;
constexpr std::size_t kPairsAtOnce = 1 << 16;
/// The step limits of thinnestWall(). A visit of a triangle is one step; a ray takes about
/// kWallStepsPerRay steps.
constexpr std::uint64_t kWallSteps = 100'000'000, kWallStepsPerTriangle = 1000,
                        kWallStepsPerRay = 4000;
constexpr double kEnd = std::numeric_limits<double>::infinity();

/// Triangles that are not faces of a wall.
class OmittedFaces {
  public:
    explicit OmittedFaces(const std::vector<char>& omitted) : omitted_(omitted) {}
    bool operator[](std::size_t triangle) const {
        return !omitted_.empty() && omitted_[triangle] != 0;
    }

  private:
    const std::vector<char>& omitted_;
};

/// Casts rays from points of triangles into the material.
class WallRays {
  public:
    WallRays(const PartTree& tree, const OmittedFaces& omitted)
        : tree_(tree), omitted_(omitted), near_(kTouching * tree.mesh().size()) {}

    double near() const { return near_; }

    /// Returns the wall behind a point of a triangle, if the wall is thinner than `below` and no
    /// other body covers the point.
    std::optional<Wall> at(std::uint32_t triangle, const glm::dvec3& from,
                           const glm::dvec3& unit_normal, double below) {
        const CheckedLine line(from, -unit_normal);
        hits_.clear();
        tree_.visit([&](const Bounds& box) { return line.meets(box, -kSlack * near_, below); },
                    [&](std::uint32_t t) {
                        if (t == triangle) return;
                        const auto hit = line.meets(tree_.mesh().corners(t));
                        if (!hit || hit->t > below) return;
                        // For surfaces in contact with this one: hits where the ray enters are
                        // skipped, and hits where the ray leaves are kept.
                        if (hit->t < (hit->leaves ? -kSlack * near_ : kSlack * near_)) return;
                        hits_.push_back(*hit);
                        hits_.back().triangle = t;
                    });
        std::sort(hits_.begin(), hits_.end(), [](const LineHit& a, const LineHit& b) {
            return a.t < b.t || (a.t == b.t && a.triangle < b.triangle);
        });
        int inside = 1;
        for (const LineHit& hit : hits_) {
            // If the ray enters at an edge, it may enter one body or two, so the count is unknown.
            if (hit.on_edge && !hit.leaves) return std::nullopt;
            inside += hit.leaves ? -1 : 1;
            if (inside > 0) continue;
            const glm::dvec3 other = unitOrZero(tree_.mesh().normal(hit.triangle));
            if (-glm::dot(other, unit_normal) < kFacing || hit.t >= below) return std::nullopt;
            if (omitted_[hit.triangle]) return std::nullopt;
            if (tree_.mesh().sharedCorners(triangle, hit.triangle) > 0) return std::nullopt;
            if (tree_.windingInFront(from, unit_normal, kSlack * near_) != 0) return std::nullopt;
            const double thickness = std::max(hit.t, 0.0);
            return Wall{thickness, from, line.at(thickness), triangle, hit.triangle};
        }
        return std::nullopt;
    }

    static const double kFacing;

  private:
    // The tolerance for surfaces in contact, as a fraction of near_. It allows only for rounding.
    static constexpr double kSlack = 1e-6;

    const PartTree& tree_;
    const OmittedFaces& omitted_;
    double near_;
    std::vector<LineHit> hits_;
};

const double WallRays::kFacing = std::cos(kWallAngle * std::numbers::pi / 180);

/// Updates `thinnest` with the wall behind the middle of a triangle.
void sampleWall(std::size_t triangle, WallRays& rays, const PartMesh& mesh,
                std::optional<Wall>& thinnest) {
    const glm::dvec3 normal = unitOrZero(mesh.normal(triangle));
    if (normal == glm::dvec3(0)) return;
    const double below = thinnest ? thinnest->thickness : kEnd;
    if (const auto wall =
            rays.at(static_cast<std::uint32_t>(triangle), mesh.middle(triangle), normal, below))
        thinnest = wall;
}

/// Returns the thinnest wall that rays from the middles of all triangles find. Samples a few
/// triangles first, so that the other rays can end early.
std::optional<Wall> sampledWall(const PartTree& tree, const OmittedFaces& omitted, StepLimit& limit,
                                const Progress& progress) {
    constexpr std::size_t kFirst = 1000;
    const PartMesh& mesh = tree.mesh();
    const std::size_t count = mesh.triangles.size();
    std::optional<Wall> first;
    WallRays first_rays(tree, omitted);
    for (std::size_t t = 0; t < count; t += std::max<std::size_t>(1, count / kFirst))
        if (!omitted[t]) sampleWall(t, first_rays, mesh, first);
    std::vector<std::optional<Wall>> found((count + kWallsAtOnce - 1) / kWallsAtOnce, first);
    parallelFor(found.size(), limit, progress, [&](std::size_t i) {
        WallRays rays(tree, omitted);
        const std::size_t end = std::min((i + 1) * kWallsAtOnce, count);
        for (std::size_t t = i * kWallsAtOnce; t < end; ++t)
            if (!omitted[t]) sampleWall(t, rays, mesh, found[i]);
    });
    std::optional<Wall> thinnest = first;
    for (const auto& wall : found)
        if (wall && (!thinnest || wall->thickness < thinnest->thickness)) thinnest = wall;
    return thinnest;
}

/// A pair of faces that overlap when seen along the normal of the first face.
struct FacePair {
    double least = 0;  ///< minimum distance from the first face to the second
    glm::dvec3 at{0};  ///< point on the first face at the minimum distance
    glm::dvec3 middle{0};
    std::uint32_t triangle = 0;
    std::uint32_t number = 0;  ///< position of the second face in the order of visits

    bool operator<(const FacePair& other) const {
        return std::tie(least, triangle, number) <
               std::tie(other.least, other.triangle, other.number);
    }
};

/// Clips a polygon to the region where a distance is at least 0.
template <class Distance>
void cutPolygon(std::vector<glm::dvec3>& polygon, std::vector<glm::dvec3>& scratch,
                Distance&& distance) {
    scratch.clear();
    for (std::size_t i = 0; i < polygon.size(); ++i) {
        const glm::dvec3 &p = polygon[i], &q = polygon[(i + 1) % polygon.size()];
        const double d = distance(p), e = distance(q);
        if (d >= 0) scratch.push_back(p);
        if ((d > 0 && e < 0) || (d < 0 && e > 0)) scratch.push_back(glm::mix(p, q, d / (d - e)));
    }
    polygon.swap(scratch);
}

/// Finds pairs of a face and a face behind it. A pair is found if the faces come closer than a
/// bound, and if the pair sorts after a given pair.
class FacePairs {
  public:
    FacePairs(const PartTree& tree, const OmittedFaces& omitted, double below,
              const std::optional<FacePair>& after)
        : tree_(tree), omitted_(omitted), below_(below), size_(tree.mesh().size()), after_(after) {}

    /// Appends the pairs of a triangle. Returns the number of triangles visited.
    std::uint64_t add(std::uint32_t triangle, std::vector<FacePair>& pairs) {
        if (omitted_[triangle]) return 0;
        const PartMesh& mesh = tree_.mesh();
        corners_ = mesh.corners(triangle);
        normal_ = unitOrZero(mesh.normal(triangle));
        if (normal_ == glm::dvec3(0)) return 0;
        std::uint32_t number = 0;
        setPrism();
        tree_.visit([&](const Bounds& box) { return meetsPrism(box); },
                    [&](std::uint32_t other) {
                        ++number;
                        if (omitted_[other] || mesh.sharedCorners(triangle, other) > 0) return;
                        auto pair = pairWith(mesh.corners(other));
                        if (!pair) return;
                        pair->triangle = triangle;
                        pair->number = number;
                        if (!after_ || *after_ < *pair) pairs.push_back(*pair);
                    });
        return number;
    }

  private:
    double depth(const glm::dvec3& p) const { return glm::dot(normal_, corners_[0] - p); }

    /// Sets the prism behind the face: its extents along the normal and along two axes of the
    /// face's plane.
    void setPrism() {
        const glm::dvec3 right = unitOrZero(corners_[1] - corners_[0]);
        prism_ = {Slab{normal_}, {right}, {glm::cross(normal_, right)}};
        for (Slab& slab : prism_) {
            for (const glm::dvec3& corner : corners_) {
                const double at = glm::dot(slab.axis, corner - corners_[0]);
                slab.min = std::min(slab.min, at);
                slab.max = std::max(slab.max, at);
            }
            slab.min -= 1e-9 * size_;
            slab.max += 1e-9 * size_;
        }
        prism_[0].min -= below_;
    }

    bool meetsPrism(const Bounds& box) const {
        const glm::dvec3 middle = (box.min + box.max) / 2.0 - corners_[0];
        const glm::dvec3 half = (box.max - box.min) / 2.0;
        return std::ranges::all_of(prism_, [&](const Slab& slab) {
            const double at = glm::dot(slab.axis, middle),
                         reach = glm::dot(glm::abs(slab.axis), half);
            return at + reach >= slab.min && at - reach <= slab.max;
        });
    }

    std::optional<FacePair> pairWith(const std::array<glm::dvec3, 3>& other) {
        const glm::dvec3 facing = unitOrZero(glm::cross(other[1] - other[0], other[2] - other[0]));
        if (-glm::dot(facing, normal_) < WallRays::kFacing) return std::nullopt;
        polygon_.assign(other.begin(), other.end());
        cutPolygon(polygon_, scratch_, [&](const glm::dvec3& p) { return depth(p); });
        for (std::size_t i = 0; i < 3 && !polygon_.empty(); ++i) {
            const glm::dvec3 inwards = glm::cross(normal_, corners_[(i + 1) % 3] - corners_[i]);
            cutPolygon(polygon_, scratch_,
                       [&](const glm::dvec3& p) { return glm::dot(inwards, p - corners_[i]); });
        }
        if (polygon_.size() < 3) return std::nullopt;
        // If the faces only share an edge when seen along the normal, they do not overlap.
        glm::dvec3 twice(0);
        for (std::size_t i = 1; i + 1 < polygon_.size(); ++i)
            twice += glm::cross(polygon_[i] - polygon_[0], polygon_[i + 1] - polygon_[0]);
        if (glm::length(twice) <= kLeastArea * size_ * size_) return std::nullopt;
        FacePair pair{kEnd};
        for (const glm::dvec3& p : polygon_) {
            const double d = depth(p);
            const glm::dvec3 on_face = p + d * normal_;
            pair.middle += on_face / double(polygon_.size());
            if (d >= pair.least) continue;
            pair.least = d;
            pair.at = on_face;
        }
        if (pair.least >= below_) return std::nullopt;
        return pair;
    }

    static constexpr double kLeastArea = 1e-15;

    const PartTree& tree_;
    const OmittedFaces& omitted_;
    double below_, size_;
    const std::optional<FacePair>& after_;
    std::array<glm::dvec3, 3> corners_{};
    glm::dvec3 normal_{0};
    struct Slab {
        glm::dvec3 axis{0};
        double min = kEnd, max = -kEnd;
    };
    std::array<Slab, 3> prism_{};
    std::vector<glm::dvec3> polygon_, scratch_;
};

/// A collection of pairs that keeps only the first kPairsAtOnce in sorted order.
class FirstPairs {
  public:
    /// Adds the pairs and clears `pairs`.
    void add(std::vector<FacePair>& pairs) {
        const std::lock_guard lock(mutex_);
        pairs_.insert(pairs_.end(), pairs.begin(), pairs.end());
        pairs.clear();
        if (pairs_.size() > 2 * kPairsAtOnce) drop();
    }

    std::vector<FacePair> take() {
        if (pairs_.size() > kPairsAtOnce) drop();
        std::sort(pairs_.begin(), pairs_.end());
        return std::move(pairs_);
    }

  private:
    void drop() {
        std::nth_element(pairs_.begin(), pairs_.begin() + kPairsAtOnce, pairs_.end());
        pairs_.resize(kPairsAtOnce);
    }

    std::mutex mutex_;
    std::vector<FacePair> pairs_;
};

std::vector<FacePair> firstPairs(const PartTree& tree, const OmittedFaces& omitted, double below,
                                 const std::optional<FacePair>& after, StepLimit& limit,
                                 const Progress& progress) {
    const std::size_t count = tree.mesh().triangles.size();
    FirstPairs first;
    parallelFor((count + kWallsAtOnce - 1) / kWallsAtOnce, limit, progress, [&](std::size_t i) {
        FacePairs finder(tree, omitted, below, after);
        std::vector<FacePair> pairs;
        const std::size_t end = std::min((i + 1) * kWallsAtOnce, count);
        for (std::size_t t = i * kWallsAtOnce; t < end && !limit.exceeded(); ++t) {
            limit.take(finder.add(static_cast<std::uint32_t>(t), pairs));
            if (pairs.size() > kPairsAtOnce || t + 1 == end) first.add(pairs);
        }
    });
    return first.take();
}

/// Finds a thinner wall between the faces of a pair.
std::optional<Wall> wallBetween(const FacePair& pair, const PartTree& tree, WallRays& rays,
                                double below, StepLimit& limit) {
    // Another body may lie between the faces at their closest point, but not everywhere. So several
    // points are tried, from the closest point to the middle of the overlap.
    for (const double share : {1e-7, 1e-4, 1e-2, 0.1, 0.3, 0.6, 1.0}) {
        limit.take(kWallStepsPerRay);
        const glm::dvec3 from = glm::mix(pair.at, pair.middle, share);
        const glm::dvec3 normal = unitOrZero(tree.mesh().normal(pair.triangle));
        if (const auto wall = rays.at(pair.triangle, from, normal, below)) return wall;
    }
    return std::nullopt;
}

}  // namespace

FoundWall thinnestWall(const PartTree& tree, const std::vector<char>& omitted_triangles,
                       const Progress& progress) {
    const OmittedFaces omitted(omitted_triangles);
    constexpr double kSampled = 0.5;
    const auto report = [&](double begin, double end, double share) {
        if (progress) progress(begin + (end - begin) * share);
    };
    StepLimit limit(kWallSteps + kWallStepsPerTriangle * tree.mesh().triangles.size());
    FoundWall found;
    found.wall =
        sampledWall(tree, omitted, limit, [&](double share) { report(0, kSampled, share); });
    const double bound = found.wall ? found.wall->thickness : tree.mesh().size();
    WallRays rays(tree, omitted);
    std::optional<FacePair> last;
    for (std::size_t pairs = kPairsAtOnce; pairs == kPairsAtOnce && !limit.exceeded();) {
        const auto first = firstPairs(
            tree, omitted, bound * (1 - kWallTolerance), last, limit,
            last ? Progress() : [&](double share) { report(kSampled, 1, share); });
        pairs = first.size();
        for (const FacePair& pair : first) {
            const double below = found.wall ? found.wall->thickness : kEnd;
            if (pair.least >= below * (1 - kWallTolerance)) return found;
            if (limit.exceeded()) break;
            if (const auto wall = wallBetween(pair, tree, rays, below, limit)) found.wall = wall;
            last = pair;
        }
    }
    found.certain = !limit.exceeded();
    return found;
}

std::vector<PartEdge> sharpEdges(const PartMesh& mesh, const PartTopology& topology) {
    std::vector<PartEdge> sharp;
    for (std::uint32_t t = 0; t < mesh.triangles.size(); ++t) {
        const glm::dvec3 normal = unitOrZero(mesh.normal(t));
        for (const std::uint32_t other : topology.beyond[t]) {
            if (other == kNoTriangle || other < t) continue;
            const glm::dvec3 beyond = unitOrZero(mesh.normal(other));
            if (-glm::dot(normal, beyond) < WallRays::kFacing) continue;
            PartEdge edge;
            glm::dvec3 tip(0);
            int common = 0;
            for (const std::uint32_t point : mesh.triangles[other]) {
                if (std::ranges::count(mesh.triangles[t], point) == 0)
                    tip = mesh.points[point];
                else
                    (common++ == 0 ? edge.a : edge.b) = point;
            }
            // A sharp angle encloses material only if the third corner of the other face lies
            // behind this face.
            if (glm::dot(normal, tip - mesh.points[edge.a]) >= 0) continue;
            if (edge.b < edge.a) std::swap(edge.a, edge.b);
            sharp.push_back(edge);
        }
    }
    return sharp;
}

}  // namespace peeler
