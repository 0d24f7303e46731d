// SPDX-License-Identifier: Apache-2.0
// What the shells of a mesh are to each other, and how much they enclose.
#include <algorithm>
#include <array>
#include <cmath>
#include <limits>
#include <map>

#include "core/base/parallel.h"
#include "core/parts/part_check.h"

namespace peeler {
namespace {

/// How many other shells are around a shell: those that a ray from it crosses an odd number of
/// times.
std::size_t depthOf(const TriangleTree& tree, const PartTopology& topology, std::uint32_t shell) {
    const PartMesh& mesh = tree.mesh();
    const std::uint32_t first = topology.shells[shell].first;
    const glm::dvec3 from = mesh.middle(first);
    constexpr double kEnd = std::numeric_limits<double>::infinity();
    std::map<std::uint32_t, bool> odd;
    // Another direction if an edge is hit; the corner of the triangle shears it a little.
    for (int attempt = 0; attempt < 4; ++attempt) {
        const glm::dvec3 direction =
            glm::normalize(glm::dvec3(0.41283 + 0.11 * attempt, 0.63127, 0.65648 - 0.23 * attempt));
        const CheckedLine line(from, direction);
        bool sure = true;
        odd.clear();
        tree.visit([&](const Bounds& box) { return line.meets(box, 0, kEnd); },
                   [&](std::uint32_t t) {
                       const std::uint32_t other = topology.shell_of[t];
                       if (other == shell || topology.shells[other].open_edges > 0) return;
                       const auto hit = line.meets(mesh.corners(t));
                       if (!hit || hit->t <= 0) return;
                       odd[other] = !odd[other];
                       sure = sure && !hit->on_edge;
                   });
        if (sure) break;
    }
    return static_cast<std::size_t>(
        std::ranges::count_if(odd, [](const auto& entry) { return entry.second; }));
}

}  // namespace

std::vector<ShellSide> findSides(const TriangleTree& tree, const PartTopology& topology) {
    std::vector<ShellSide> sides(topology.shells.size(), ShellSide::kOpen);
    parallelFor(sides.size(), [&](std::size_t i) {
        const PartShell& shell = topology.shells[i];
        if (shell.open_edges > 0 || !shell.orientable) return;
        const bool enclosed = depthOf(tree, topology, static_cast<std::uint32_t>(i)) % 2 == 1;
        if (shell.volume < 0)
            sides[i] = enclosed ? ShellSide::kCavity : ShellSide::kInsideOut;
        else
            sides[i] = enclosed ? ShellSide::kInside : ShellSide::kOutside;
    });
    return sides;
}

PartMesh turnedBack(const PartMesh& mesh, const PartTopology& topology,
                    const std::vector<ShellSide>& sides) {
    PartMesh back = mesh;
    for (const std::uint32_t t : topology.turned)
        std::swap(back.triangles[t][1], back.triangles[t][2]);
    for (std::size_t t = 0; t < back.triangles.size(); ++t)
        if (sides[topology.shell_of[t]] == ShellSide::kInsideOut)
            std::swap(back.triangles[t][1], back.triangles[t][2]);
    return back;
}

double areaOf(const PartMesh& mesh) {
    double area = 0;
    for (std::size_t t = 0; t < mesh.triangles.size(); ++t)
        area += glm::length(mesh.normal(t)) / 2;
    return area;
}

double volumeOf(const PartMesh& mesh) {
    const Bounds box = mesh.bounds();
    const glm::dvec3 origin = (box.min + box.max) / 2.0;
    double six = 0;
    for (std::size_t t = 0; t < mesh.triangles.size(); ++t) {
        const auto [a, b, c] = mesh.corners(t);
        six += glm::dot(a - origin, glm::cross(b - origin, c - origin));
    }
    return six / 6;
}

namespace {

/// The part of a triangle that nothing else's inside is in front of, by cutting it into strips.
class FreeArea {
  public:
    FreeArea(const TriangleTree& tree, double near) : tree_(tree), near_(near) {}

    double of(std::uint32_t triangle) {
        place(triangle);
        if (length_ == 0) return 0;
        collect(triangle);
        const std::vector<double> cuts = strips();
        double area = 0;
        for (std::size_t i = 0; i + 1 < cuts.size(); ++i) {
            const double width = cuts[i + 1] - cuts[i];
            if (width > kNarrow * length_) area += width * freeLength((cuts[i] + cuts[i + 1]) / 2);
        }
        return area;
    }

  private:
    static constexpr double kNarrow = 1e-12;
    static constexpr std::size_t kMostLines = 120;
    static constexpr int kStrips = 256;

    /// Where the plane of another triangle is crossed, in this one's.
    struct Line {
        glm::dvec2 p, q;
        int jump = 0;  ///< of the winding in front, from below to above it
    };
    /// A triangle in the plane of this one, in front of it by agreement.
    struct Cover {
        std::array<glm::dvec2, 3> corner;
        int winding = 0;

        bool covers(const glm::dvec2& p) const {
            int left = 0;
            for (std::size_t i = 0; i < 3; ++i) {
                const glm::dvec2 along = corner[(i + 1) % 3] - corner[i], to = p - corner[i];
                left += along.x * to.y - along.y * to.x > 0 ? 1 : 0;
            }
            return left == 0 || left == 3;
        }
    };

    glm::dvec2 flat(const glm::dvec3& p) const {
        return {glm::dot(p - origin_, right_), glm::dot(p - origin_, up_)};
    }

    void place(std::uint32_t triangle) {
        const auto [a, b, c] = tree_.mesh().corners(triangle);
        origin_ = a;
        normal_ = unitOrZero(glm::cross(b - a, c - a));
        right_ = unitOrZero(b - a);
        up_ = glm::cross(normal_, right_);
        length_ = normal_ == glm::dvec3(0) ? 0 : glm::length(b - a) + glm::length(c - a);
        own_ = {flat(a), flat(b), flat(c)};
    }

    void collect(std::uint32_t triangle) {
        lines_.clear();
        covers_.clear();
        const PartMesh& mesh = tree_.mesh();
        const Bounds box = grown(boundsOf(mesh.corners(triangle)), near_);
        tree_.visit([&](const Bounds& other) { return overlap(box, other); },
                    [&](std::uint32_t s) {
                        if (s != triangle && overlap(box, boundsOf(mesh.corners(s))))
                            add(mesh.corners(s), s < triangle);
                    });
    }

    void add(const std::array<glm::dvec3, 3>& other, bool before) {
        std::array<double, 3> d{};
        int above = 0, away = 0;
        for (std::size_t i = 0; i < 3; ++i) {
            d[i] = glm::dot(normal_, other[i] - origin_);
            above += d[i] > near_ ? 1 : 0;
            away += std::abs(d[i]) > near_ ? 1 : 0;
        }
        const glm::dvec3 facing = glm::cross(other[1] - other[0], other[2] - other[0]);
        if (away == 0) {
            // Of two that face alike the first is in front; of two that face each other both are,
            // as if there were a gap between their bodies.
            const int winding = glm::dot(facing, normal_) > 0 ? 1 : -1;
            if (winding > 0 && !before) return;
            covers_.push_back({{flat(other[0]), flat(other[1]), flat(other[2])}, winding});
            return;
        }
        if (above == 0 || above == 3) return;
        // Where it goes through the plane just in front: a corner within `near_` counts as below.
        std::vector<glm::dvec2> ends;
        for (std::size_t i = 0; i < 3; ++i) {
            const std::size_t k = (i + 1) % 3;
            if ((d[i] > near_) == (d[k] > near_)) continue;
            const std::size_t low = d[i] > near_ ? k : i, high = d[i] > near_ ? i : k;
            const double share = std::clamp(-d[low] / (d[high] - d[low]), 0.0, 1.0);
            ends.push_back(flat(glm::mix(other[low], other[high], share)));
        }
        lines_.push_back({ends[0], ends[1], glm::dot(facing, up_) > 0 ? -1 : 1});
    }

    /// Every place along `right_` where what is free changes otherwise than linearly.
    std::vector<double> strips() {
        double low = own_[0].x, high = own_[0].x;
        for (const glm::dvec2& p : own_) {
            low = std::min(low, p.x);
            high = std::max(high, p.x);
        }
        edges_ = lines_;
        for (std::size_t i = 0; i < 3; ++i)
            edges_.push_back({own_[i], own_[(i + 1) % 3]});
        for (const Cover& cover : covers_)
            for (std::size_t i = 0; i < 3; ++i)
                edges_.push_back({cover.corner[i], cover.corner[(i + 1) % 3]});
        std::vector<double> cuts{low, high};
        if (edges_.size() > kMostLines) {
            for (int i = 1; i < kStrips; ++i)
                cuts.push_back(low + (high - low) * i / kStrips);
        } else {
            addEnds(cuts);
        }
        std::erase_if(cuts, [&](double x) { return !(x >= low && x <= high); });
        std::sort(cuts.begin(), cuts.end());
        return cuts;
    }

    void addEnds(std::vector<double>& cuts) const {
        for (std::size_t i = 0; i < edges_.size(); ++i) {
            cuts.insert(cuts.end(), {edges_[i].p.x, edges_[i].q.x});
            const glm::dvec2 u = edges_[i].q - edges_[i].p;
            for (std::size_t k = i + 1; k < edges_.size(); ++k) {
                const glm::dvec2 v = edges_[k].q - edges_[k].p, to = edges_[k].p - edges_[i].p;
                const double across = u.x * v.y - u.y * v.x;
                if (across == 0) continue;
                const double s = (to.x * v.y - to.y * v.x) / across,
                             t = (to.x * u.y - to.y * u.x) / across;
                if (s >= 0 && s <= 1 && t >= 0 && t <= 1) cuts.push_back(edges_[i].p.x + s * u.x);
            }
        }
    }

    /// A place on the line at x, and by how much the winding jumps there.
    struct Step {
        double y;
        int jump;
    };

    static std::optional<double> heightAt(const Line& line, double x) {
        if ((line.p.x > x) == (line.q.x > x)) return std::nullopt;
        return line.p.y + (line.q.y - line.p.y) * (x - line.p.x) / (line.q.x - line.p.x);
    }

    /// How much of the line at x, which no corner and no crossing is on, is free.
    double freeLength(double x) {
        double low = std::numeric_limits<double>::infinity(), high = -low;
        for (std::size_t i = 0; i < 3; ++i) {
            if (const auto y = heightAt({own_[i], own_[(i + 1) % 3]}, x)) {
                low = std::min(low, *y);
                high = std::max(high, *y);
            }
        }
        if (!(high > low)) return 0;
        steps_.assign(1, {low, 0});
        for (const Line& line : edges_)
            if (const auto y = heightAt(line, x); y && *y > low && *y < high)
                steps_.push_back({*y, line.jump});
        steps_.push_back({high, 0});
        std::sort(steps_.begin(), steps_.end(),
                  [](const Step& a, const Step& b) { return a.y < b.y; });
        return sumFree(x);
    }

    double sumFree(double x) const {
        // Asked where it is surest, in the middle of the longest stretch.
        std::size_t longest = 0;
        for (std::size_t i = 0; i + 1 < steps_.size(); ++i)
            if (lengthOf(i) > lengthOf(longest)) longest = i;
        const double y = (steps_[longest].y + steps_[longest + 1].y) / 2;
        int winding = tree_.windingInFront(origin_ + x * right_ + y * up_, normal_, near_);
        for (std::size_t i = longest; i > 0; --i)
            winding -= steps_[i].jump;
        double free = 0;
        for (std::size_t i = 0; i + 1 < steps_.size(); ++i) {
            winding += steps_[i].jump;
            const glm::dvec2 middle(x, (steps_[i].y + steps_[i + 1].y) / 2);
            int here = winding;
            for (const Cover& cover : covers_)
                here += cover.covers(middle) ? cover.winding : 0;
            if (here == 0) free += lengthOf(i);
        }
        return free;
    }

    double lengthOf(std::size_t step) const { return steps_[step + 1].y - steps_[step].y; }

    const TriangleTree& tree_;
    double near_;
    glm::dvec3 origin_{0}, normal_{0}, right_{0}, up_{0};
    double length_ = 0;
    std::array<glm::dvec2, 3> own_{};
    std::vector<Line> lines_, edges_;
    std::vector<Cover> covers_;
    std::vector<Step> steps_;
};

/// Of triangles that nothing touches, those that hang together have the same in front of them: one
/// of each patch is asked.
std::vector<std::vector<std::uint32_t>> patchesOf(const PartTopology& topology,
                                                  const std::vector<char>& touched) {
    std::vector<std::vector<std::uint32_t>> patches;
    std::vector<char> seen = touched;
    for (std::uint32_t seed = 0; seed < seen.size(); ++seed) {
        if (seen[seed]) continue;
        seen[seed] = 1;
        std::vector<std::uint32_t>& patch = patches.emplace_back(1, seed);
        for (std::size_t i = 0; i < patch.size(); ++i) {
            for (const std::uint32_t other : topology.beyond[patch[i]]) {
                if (other == kNoTriangle || seen[other]) continue;
                seen[other] = 1;
                patch.push_back(other);
            }
        }
    }
    return patches;
}

}  // namespace

double unionVolume(const TriangleTree& tree, const PartTopology& topology,
                   const Crossings& crossings) {
    const PartMesh& mesh = tree.mesh();
    const Bounds box = mesh.bounds();
    const glm::dvec3 origin = (box.min + box.max) / 2.0;
    const double near = kTouching * mesh.size();
    const auto patches = patchesOf(topology, crossings.touched);
    std::vector<std::uint32_t> touched;
    for (std::uint32_t t = 0; t < crossings.touched.size(); ++t)
        if (crossings.touched[t]) touched.push_back(t);
    std::vector<double> shares(patches.size() + touched.size());
    parallelFor(shares.size(), [&](std::size_t i) {
        // The volume under a face: its area times its plane's distance, a third.
        if (i >= patches.size()) {
            const std::uint32_t t = touched[i - patches.size()];
            const glm::dvec3 normal = unitOrZero(mesh.normal(t));
            shares[i] = FreeArea(tree, near).of(t) * glm::dot(normal, mesh.middle(t) - origin) / 3;
            return;
        }
        const auto& patch = patches[i];
        const auto size = [&](std::uint32_t t) { return glm::length(mesh.normal(t)); };
        const std::uint32_t asked = std::ranges::max(patch, {}, size);
        if (size(asked) == 0) return;
        if (tree.windingInFront(mesh.middle(asked), mesh.normal(asked), near) != 0) return;
        for (const std::uint32_t t : patch)
            shares[i] += glm::dot(mesh.normal(t), mesh.middle(t) - origin) / 6;
    });
    double sum = 0;
    for (const double share : shares)
        sum += share;
    return sum;
}

}  // namespace peeler
