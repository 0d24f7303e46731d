// SPDX-License-Identifier: Apache-2.0
// Checks parts one by one, and then how they lie to each other.
#include <algorithm>
#include <cmath>
#include <map>
#include <numeric>

#include "cmd/check/part_report.h"
#include "core/base/error.h"

namespace peeler::cmd {

namespace {

/// How many places of a kind are told and marked.
constexpr std::size_t kPlaces = 100;

class PartChecker {
  public:
    PartChecker(PartReport& report, const std::optional<double>& least_wall)
        : report_(report), least_wall_(least_wall) {}

    void run() {
        report_.topology = findTopology(report_.mesh);
        if (report_.mesh.triangles.empty()) {
            add(PartProblem::kEmpty, 1, {});
            return;
        }
        report_.sides = findSides(TriangleTree(report_.mesh), report_.topology);
        report_.turned = turnedBack(report_.mesh, report_.topology, report_.sides);
        const TriangleTree tree(report_.turned);
        Crossings crossings = findCrossings(tree);
        report_.crossings = crossings.pairs;
        report_.area = areaOf(report_.mesh);
        report_.wall = thinnestWall(tree);
        report_.sharp = sharpEdges(report_.turned, report_.topology);
        addProblems();
        if (!report_.topology.closed() || report_.count(PartProblem::kOneSided) > 0) return;
        report_.volume = volumeOf(report_.turned);
        report_.union_volume = unionVolume(tree, report_.topology, crossings);
    }

  private:
    template <class Places>
    void add(PartProblem kind, std::uint64_t count, const Places& places) {
        if (count == 0) return;
        FoundProblem problem{kind, count};
        for (std::size_t i = 0; i < std::min(places.size(), kPlaces); ++i)
            problem.places.push_back(places[i]);
        report_.problems.push_back(std::move(problem));
    }
    void add(PartProblem kind, std::uint64_t count, std::initializer_list<glm::dvec3> places) {
        add(kind, count, std::vector<glm::dvec3>(places));
    }

    std::vector<glm::dvec3> middlesOf(const std::vector<PartEdge>& edges) const {
        std::vector<glm::dvec3> middles;
        for (const PartEdge& edge : edges)
            middles.push_back((report_.mesh.points[edge.a] + report_.mesh.points[edge.b]) / 2.0);
        return middles;
    }
    std::vector<glm::dvec3> middlesOf(const std::vector<std::uint32_t>& triangles) const {
        std::vector<glm::dvec3> middles;
        for (const std::uint32_t t : triangles)
            middles.push_back(report_.mesh.middle(t));
        return middles;
    }
    /// One triangle of each shell that lies so.
    std::vector<std::uint32_t> shellsOf(ShellSide side) const {
        std::vector<std::uint32_t> found;
        for (std::size_t i = 0; i < report_.sides.size(); ++i)
            if (report_.sides[i] == side) found.push_back(report_.topology.shells[i].first);
        return found;
    }

    void addProblems() {
        const PartTopology& topology = report_.topology;
        add(PartProblem::kOpenEdges, topology.open.size(), middlesOf(topology.open));
        add(PartProblem::kCrowdedEdges, topology.crowded.size(), middlesOf(topology.crowded));
        add(PartProblem::kTurnedTriangles, topology.turned.size(), middlesOf(topology.turned));
        std::vector<std::uint32_t> one_sided;
        for (const PartShell& shell : topology.shells)
            if (!shell.orientable) one_sided.push_back(shell.first);
        add(PartProblem::kOneSided, one_sided.size(), middlesOf(one_sided));
        const auto inside_out = shellsOf(ShellSide::kInsideOut);
        add(PartProblem::kInsideOut, inside_out.size(), middlesOf(inside_out));
        addCrossings();
        if (least_wall_ && report_.wall && report_.wall->thickness < *least_wall_)
            add(PartProblem::kThinWall, 1, {report_.wall->from});
    }

    /// What of the crossings is one shell through itself, and what are shells in each other.
    void addCrossings() {
        std::vector<std::uint32_t> own, others = shellsOf(ShellSide::kInside);
        std::uint64_t own_pairs = 0, overlapping = others.size();
        std::map<std::pair<std::uint32_t, std::uint32_t>, std::uint64_t> shells;
        for (const auto& [a, b] : report_.crossings) {
            const std::uint32_t x = report_.topology.shell_of[a], y = report_.topology.shell_of[b];
            if (x == y) {
                ++own_pairs;
                own.push_back(a);
            } else if (++shells[std::minmax(x, y)] == 1) {
                ++overlapping;
                others.push_back(a);
            }
        }
        add(PartProblem::kSelfIntersections, own_pairs, middlesOf(own));
        add(PartProblem::kOverlaps, overlapping, middlesOf(others));
    }

    PartReport& report_;
    const std::optional<double>& least_wall_;
};

/// Where the triangles of each part begin in a joined mesh of them.
std::vector<std::size_t> firstTriangles(const std::vector<PartReport>& parts) {
    std::vector<std::size_t> first{0};
    for (const PartReport& part : parts)
        first.push_back(first.back() + part.turned.triangles.size());
    return first;
}

/// The topology of parts side by side, as far as unionVolume() needs it.
PartTopology sideBySide(const std::vector<PartReport>& parts) {
    PartTopology all;
    for (const PartReport& part : parts) {
        const auto before = static_cast<std::uint32_t>(all.beyond.size());
        for (auto beyond : part.topology.beyond) {
            for (std::uint32_t& other : beyond)
                if (other != kNoTriangle) other += before;
            all.beyond.push_back(beyond);
        }
    }
    return all;
}

void checkOverlaps(CheckReport& report) {
    std::vector<const PartMesh*> meshes;
    bool closed = true;
    for (const PartReport& part : report.parts) {
        meshes.push_back(&part.turned);
        closed = closed && part.volume;
    }
    const PartMesh all = joinParts(meshes, false);
    const TriangleTree tree(all);
    const Crossings crossings = findCrossings(tree);
    const std::vector<std::size_t> first = firstTriangles(report.parts);
    const auto partOf = [&](std::uint32_t triangle) {
        return static_cast<std::size_t>(std::upper_bound(first.begin(), first.end(), triangle) -
                                        first.begin()) -
               1;
    };
    std::map<std::pair<std::size_t, std::size_t>, PartOverlap> overlaps;
    for (const auto& [a, b] : crossings.pairs) {
        const std::size_t x = partOf(a), y = partOf(b);
        if (x == y) continue;
        const auto [entry, fresh] = overlaps.try_emplace(std::minmax(x, y));
        PartOverlap& overlap = entry->second;
        if (fresh) overlap = {entry->first.first, entry->first.second, 0, all.middle(a)};
        ++overlap.pairs;
    }
    for (const auto& [parts, overlap] : overlaps)
        report.overlaps.push_back(overlap);
    if (!closed) return;
    report.volume = 0;
    for (const PartReport& part : report.parts)
        *report.volume += *part.union_volume;
    report.union_volume = unionVolume(tree, sideBySide(report.parts), crossings);
}

}  // namespace

std::uint64_t PartReport::count(PartProblem kind) const {
    const auto found = std::ranges::find(problems, kind, &FoundProblem::kind);
    return found == problems.end() ? 0 : found->count;
}

std::size_t PartReport::shellsOf(ShellSide side) const {
    return static_cast<std::size_t>(std::ranges::count(sides, side));
}

std::size_t CheckReport::faulty() const {
    return static_cast<std::size_t>(
        std::ranges::count_if(parts, [](const PartReport& part) { return !part.good(); }));
}

std::optional<std::size_t> CheckReport::thinnest() const {
    std::optional<std::size_t> thinnest;
    for (std::size_t i = 0; i < parts.size(); ++i) {
        if (!parts[i].wall) continue;
        if (!thinnest || parts[i].wall->thickness < parts[*thinnest].wall->thickness) thinnest = i;
    }
    return thinnest;
}

CheckReport checkParts(const PosedScene& posed, const CheckSettings& settings,
                       const std::function<void(double)>& progress) {
    CheckReport report;
    report.metres = settings.metres;
    report.least_wall = settings.least_wall;
    const std::vector<std::uint32_t> ordinals = posed.instanceOrdinals();
    std::vector<PartReport> parts;
    for (std::size_t i = 0; i < posed.meshes().size(); ++i) {
        const MeshInstance& instance = posed.meshes()[i];
        PartReport part;
        part.name = nodeName(posed.scene(), static_cast<std::size_t>(instance.node));
        part.node = instance.node;
        part.instance = ordinals[i];
        part.mesh = partMesh(posed, instance);
        // Lines and points are no part.
        if (!part.mesh.triangles.empty() || part.mesh.degenerate > 0)
            parts.push_back(std::move(part));
    }
    if (parts.empty())
        throw Error(ErrorKind::kInput, "the scene shows no triangles", "",
                    "peeler info tells what is in it");
    if (settings.together && parts.size() > 1) {
        std::vector<const PartMesh*> meshes;
        for (const PartReport& part : parts)
            meshes.push_back(&part.mesh);
        PartReport all;
        all.name = "all parts together";
        all.mesh = joinParts(meshes, true);
        parts.clear();
        parts.push_back(std::move(all));
    }
    report.parts = std::move(parts);
    report.bounds = report.parts.front().mesh.bounds();
    std::size_t triangles = 0, done = 0;
    for (const PartReport& part : report.parts) {
        for (const glm::dvec3& p : part.mesh.points) {
            if (std::isfinite(p.x) && std::isfinite(p.y) && std::isfinite(p.z)) continue;
            throw Error(ErrorKind::kInput, "a part reaches infinitely far", part.name,
                        "leave it out with --exclude");
        }
        triangles += part.mesh.triangles.size();
        const Bounds box = part.mesh.bounds();
        report.bounds.min = glm::min(report.bounds.min, box.min);
        report.bounds.max = glm::max(report.bounds.max, box.max);
    }
    // The parts, and then the same triangles once more, all together.
    const double all = static_cast<double>(triangles + 1) * (report.parts.size() > 1 ? 2 : 1);
    for (PartReport& part : report.parts) {
        PartChecker(part, report.least_wall).run();
        done += part.mesh.triangles.size();
        progress(static_cast<double>(done) / all);
    }
    if (report.parts.size() > 1) checkOverlaps(report);
    progress(1);
    return report;
}

}  // namespace peeler::cmd
