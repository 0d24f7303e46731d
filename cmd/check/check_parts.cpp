// SPDX-License-Identifier: Apache-2.0
#include "cmd/check/check_parts.h"

#include <algorithm>
#include <cmath>
#include <map>
#include <numeric>
#include <span>

#include <peeler/error.h>
#include "cmd/check/part_report.h"

namespace peeler::cmd {

namespace {

/// The maximum number of places that are listed and marked per kind of fault.
constexpr std::size_t kPlaces = 100;

/// The progress of a part, from 0 to 1, at the end of each stage.
constexpr double kTopologyEnd = 0.12, kCrossingsEnd = 0.25, kVolumesEnd = 0.28, kWallEnd = 0.95;

/// Returns a progress callback that maps a stage's share to the range from `begin` to `end`.
Progress between(const Progress& progress, double begin, double end) {
    return [=](double share) { progress(begin + (end - begin) * share); };
}

class PartChecker {
  public:
    PartChecker(PartReport& report, const CheckSettings& settings, const Progress& progress)
        : report_(report), settings_(settings), progress_(progress) {}

    void run() {
        report_.topology = findTopology(report_.mesh);
        weld();
        if (report_.mesh.triangles.empty()) {
            add(PartProblem::kEmpty, 1, {});
            return;
        }
        report_.sides = findSides(PartTree(report_.mesh), report_.topology);
        report_.turned = turnedBack(report_.mesh, report_.topology, report_.sides);
        const PartTree tree(report_.turned);
        report_.crossings = findCrossings(tree, between(progress_, kTopologyEnd, kCrossingsEnd));
        report_.area = areaOf(report_.mesh);
        report_.sharp = sharpEdges(report_.turned, report_.topology);
        findVolumes(tree);
        findWall(tree);
        addProblems();
    }

  private:
    /// Welds points of open edges. Leaves a closed part as it is.
    void weld() {
        report_.weld = settings_.weld.value_or(kTouching * report_.mesh.size());
        report_.was_open = !report_.topology.closed();
        if (!report_.was_open || !(report_.weld > 0)) return;
        PartMesh welded = weldPoints(report_.mesh, pointsOf(report_.topology.open), report_.weld);
        report_.welded_points = report_.mesh.points.size() - welded.points.size();
        if (report_.welded_points == 0) return;
        report_.mesh = std::move(welded);
        report_.topology = findTopology(report_.mesh);
    }

    void findVolumes(const PartTree& tree) {
        const PartTopology& topology = report_.topology;
        if (!topology.closed() || !std::ranges::all_of(topology.shells, &PartShell::orientable))
            return;
        report_.volume = volumeOf(report_.turned);
        report_.union_volume = unionVolume(tree, topology, report_.crossings,
                                           between(progress_, kCrossingsEnd, kVolumesEnd));
    }

    /// Finds the thinnest wall between faces that no surface crosses. If a wall with a crossed face
    /// is thinner, sets `crossed_wall`, too. Finds no wall if there are too many crossings to
    /// determine the union.
    void findWall(const PartTree& tree) {
        FoundWall& found = report_.found_wall;
        found.certain = !report_.crossings.more && (report_.union_volume || !report_.volume);
        if (!found.certain) return;
        const std::vector<char> crossed = crossedTriangles(report_.crossings);
        found = thinnestWall(tree, {}, between(progress_, kVolumesEnd, kWallEnd));
        if (!found.wall || !(crossed[found.wall->triangle] || crossed[found.wall->opposite]))
            return;
        report_.crossed_wall = found.wall;
        found = thinnestWall(tree, crossed, between(progress_, kWallEnd, 1));
    }

    void add(PartProblem kind, std::uint64_t count, std::vector<glm::dvec3> places,
             bool more = false) {
        if (count > 0) report_.problems.push_back({kind, count, std::move(places), more});
    }

    template <class Place>
    static std::span<const Place> firstOf(const std::vector<Place>& places) {
        return std::span(places).first(std::min(places.size(), kPlaces));
    }
    std::vector<glm::dvec3> middlesOf(const std::vector<PartEdge>& edges) const {
        std::vector<glm::dvec3> middles;
        for (const PartEdge& edge : firstOf(edges))
            middles.push_back((report_.mesh.points[edge.a] + report_.mesh.points[edge.b]) / 2.0);
        return middles;
    }
    std::vector<glm::dvec3> middlesOf(const std::vector<std::uint32_t>& triangles) const {
        std::vector<glm::dvec3> middles;
        for (const std::uint32_t t : firstOf(triangles))
            middles.push_back(report_.mesh.middle(t));
        return middles;
    }
    /// Returns the first triangle of each shell with this ShellSide.
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
        const auto flat = shellsOf(ShellSide::kFlat);
        add(PartProblem::kFlat, flat.size(), middlesOf(flat));
        addCrossings();
        if (settings_.least_wall) addWall();
    }

    void addWall() {
        const std::optional<Wall>& wall = report_.wall();
        if (wall && wall->thickness < *settings_.least_wall * (1 - kWallTolerance))
            add(PartProblem::kThinWall, 1, {wall->from});
        else if (!report_.found_wall.certain)
            add(PartProblem::kUncertainWall, 1, {});
    }

    /// Adds self-intersections of a shell, and overlaps between shells, from the crossings.
    void addCrossings() {
        const CrossingCurve curve(report_.turned);
        report_.crossing_length = curve.length(report_.crossings.pairs);
        const auto inside = shellsOf(ShellSide::kInside);
        std::vector<glm::dvec3> own, others = middlesOf(inside);
        const auto mark = [&](std::vector<glm::dvec3>& places, const CrossingPair& pair) {
            if (places.size() < kPlaces) places.push_back(curve.middle(pair));
        };
        std::uint64_t own_pairs = 0, overlapping = inside.size();
        std::map<std::pair<std::uint32_t, std::uint32_t>, std::uint64_t> shells;
        for (const CrossingPair& pair : report_.crossings.pairs) {
            const std::uint32_t x = report_.topology.shell_of[pair.first],
                                y = report_.topology.shell_of[pair.second];
            if (x == y) {
                ++own_pairs;
                mark(own, pair);
            } else if (++shells[std::minmax(x, y)] == 1) {
                ++overlapping;
                mark(others, pair);
            }
        }
        const bool more = report_.crossings.more;
        add(PartProblem::kSelfIntersections, own_pairs, std::move(own), more);
        add(PartProblem::kOverlaps, overlapping, std::move(others), more);
        add(PartProblem::kUncertainCrossings, more ? 1 : 0, {});
    }

    PartReport& report_;
    const CheckSettings& settings_;
    const Progress& progress_;
};

/// Returns the index of each part's first triangle in the mesh that joins all parts.
std::vector<std::size_t> firstTriangles(const std::vector<PartReport>& parts) {
    std::vector<std::size_t> first{0};
    for (const PartReport& part : parts)
        first.push_back(first.back() + part.turned.triangles.size());
    return first;
}

/// Returns the topology of the mesh that joins all parts. Sets only the fields that unionVolume()
/// needs.
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

void checkOverlaps(CheckReport& report, const Progress& progress) {
    std::vector<const PartMesh*> meshes;
    for (const PartReport& part : report.parts)
        meshes.push_back(&part.turned);
    const PartMesh all = joinParts(meshes, false);
    const PartTree tree(all);
    const Crossings crossings = findCrossings(tree, between(progress, 0, 0.4));
    report.more = crossings.more;
    const std::vector<std::size_t> first = firstTriangles(report.parts);
    const auto partOf = [&](std::uint32_t triangle) {
        return static_cast<std::size_t>(std::upper_bound(first.begin(), first.end(), triangle) -
                                        first.begin()) -
               1;
    };
    const CrossingCurve curve(all);
    std::map<std::pair<std::size_t, std::size_t>, PartOverlap> overlaps;
    for (const CrossingPair& pair : crossings.pairs) {
        const std::size_t x = partOf(pair.first), y = partOf(pair.second);
        if (x == y) continue;
        const auto [entry, fresh] = overlaps.try_emplace(std::minmax(x, y));
        PartOverlap& overlap = entry->second;
        if (fresh) overlap = {entry->first.first, entry->first.second, 0, curve.middle(pair)};
        ++overlap.pairs;
    }
    for (const auto& [parts, overlap] : overlaps)
        report.overlaps.push_back(overlap);
    double sum = 0;
    for (const PartReport& part : report.parts) {
        if (!part.union_volume) return;
        sum += *part.union_volume;
    }
    report.volume = sum;
    report.union_volume =
        unionVolume(tree, sideBySide(report.parts), crossings, between(progress, 0.4, 1));
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
        if (!parts[i].wall()) continue;
        if (!thinnest || parts[i].wall()->thickness < parts[*thinnest].wall()->thickness)
            thinnest = i;
    }
    return thinnest;
}

CheckReport checkParts(const PosedScene& posed, const CheckSettings& settings,
                       const std::function<void(double)>& progress) {
    CheckReport report;
    report.metres = settings.metres;
    const std::vector<std::uint32_t> ordinals = posed.instanceOrdinals();
    std::vector<PartReport> parts;
    for (std::size_t i = 0; i < posed.meshes().size(); ++i) {
        const MeshInstance& instance = posed.meshes()[i];
        PartReport part;
        part.name = nodeName(posed.scene(), static_cast<std::size_t>(instance.node));
        part.node = instance.node;
        part.instance = ordinals[i];
        part.mesh = partMesh(posed, instance);
        // Meshes of lines and points only are not parts.
        if (!part.mesh.triangles.empty() || part.mesh.degenerate > 0)
            parts.push_back(std::move(part));
    }
    if (parts.empty())
        throw Error(ErrorKind::kInput, "the scene shows no triangles", "",
                    "list its content with peeler info");
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
            throw Error(ErrorKind::kInput, "a part's bounds are infinite", part.name,
                        "leave it out with --exclude");
        }
        triangles += part.mesh.triangles.size();
        const Bounds box = part.mesh.bounds();
        report.bounds.min = glm::min(report.bounds.min, box.min);
        report.bounds.max = glm::max(report.bounds.max, box.max);
    }
    // Progress is proportional to triangles. With several parts, checkOverlaps() adds a fifth.
    const double all = static_cast<double>(triangles + 1) * (report.parts.size() > 1 ? 1.2 : 1);
    for (PartReport& part : report.parts) {
        const double begin = static_cast<double>(done) / all;
        done += part.mesh.triangles.size();
        PartChecker(part, settings, between(progress, begin, static_cast<double>(done) / all))
            .run();
    }
    if (report.parts.size() > 1)
        checkOverlaps(report, between(progress, static_cast<double>(done) / all, 1));
    progress(1);
    return report;
}

}  // namespace peeler::cmd
