// SPDX-License-Identifier: Apache-2.0
#include "cmd/check/places_scene.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <numbers>
#include <set>
#include <utility>

#include "cmd/check/part_report.h"
#include "core/scene/framing.h"

namespace peeler::cmd {

namespace {

/// The colour and legend text of a kind of mark.
struct Mark {
    const char* text;
    std::array<float, 3> color;  ///< linear
};
constexpr Mark kOpenMark{"open edges", {1, 0.02F, 0.02F}};
constexpr Mark kCrowdedMark{"edges of more than two triangles", {0.9F, 0, 0.7F}};
constexpr Mark kTurnedMark{"flipped or inside out", {1, 0.3F, 0}};
constexpr Mark kCrossingMark{"crossings", {0.9F, 0.75F, 0}};
constexpr const char* kOverlapText = "crossing or overlapping";
constexpr Mark kFlatMark{"without volume", {0, 0.4F, 0.3F}};
constexpr Mark kWallMark{"thinnest wall", {0, 0.15F, 1}};

constexpr std::pair<PartProblem, Mark> kMarks[] = {
    {PartProblem::kOpenEdges, kOpenMark},         {PartProblem::kCrowdedEdges, kCrowdedMark},
    {PartProblem::kTurnedTriangles, kTurnedMark}, {PartProblem::kOneSided, kTurnedMark},
    {PartProblem::kInsideOut, kTurnedMark},       {PartProblem::kSelfIntersections, kCrossingMark},
    {PartProblem::kOverlaps, kCrossingMark},      {PartProblem::kThinWall, kWallMark},
    {PartProblem::kEmpty, kTurnedMark},           {PartProblem::kFlat, kFlatMark},
    {PartProblem::kUncertainWall, kWallMark},     {PartProblem::kUncertainCrossings, kCrossingMark},
};

/// The number of a part's crossings that are drawn thick; the others are drawn as thin lines.
constexpr std::size_t kRods = 100'000;
/// The radius of a thick line, as a fraction of a ball's.
constexpr double kRodRadius = 0.3;

const Mark& markOf(PartProblem kind) {
    return std::ranges::find(kMarks, kind, &std::pair<PartProblem, Mark>::first)->second;
}

/// A builder of a scene from primitives of one colour each.
class PlacesScene {
  public:
    PlacesScene() {
        scene_.scenes.resize(1);
        scene_.scenes[0].roots = {0};
        scene_.nodes.resize(1);
        scene_.nodes[0].mesh = 0;
        scene_.meshes.resize(1);
    }

    /// Adds a primitive with a new material. The returned reference is valid until the next call.
    Primitive& add(const std::array<float, 3>& color, float alpha, Topology topology) {
        Material material;
        material.base_color = {color[0], color[1], color[2], alpha};
        material.alpha_mode = alpha < 1 ? AlphaMode::kBlend : AlphaMode::kOpaque;
        material.double_sided = true;
        material.metallic = 0;
        material.unlit = alpha == 1;
        Primitive primitive;
        primitive.topology = topology;
        primitive.material = static_cast<int>(scene_.materials.size());
        scene_.materials.push_back(material);
        scene_.meshes[0].primitives.push_back(std::move(primitive));
        return scene_.meshes[0].primitives.back();
    }

    Scene finish() {
        auto& primitives = scene_.meshes[0].primitives;
        std::erase_if(primitives, [](const Primitive& p) { return p.positions.empty(); });
        scene_.materials.emplace_back();  // Scene requires glTF's default material as the last
        return std::move(scene_);
    }

  private:
    Scene scene_;
};

void addBall(Primitive& primitive, const glm::dvec3& middle, double radius) {
    constexpr int kAround = 12, kAcross = 6;
    const auto at = [&](int i, int j) {
        const double u = 2 * std::numbers::pi * i / kAround, v = std::numbers::pi * j / kAcross;
        return glm::vec3(middle + radius * glm::dvec3(std::sin(v) * std::cos(u), std::cos(v),
                                                      std::sin(v) * std::sin(u)));
    };
    for (int i = 0; i < kAround; ++i) {
        for (int j = 0; j < kAcross; ++j) {
            for (const auto& [a, b] : {std::pair{0, 0}, {1, 0}, {1, 1}, {0, 0}, {1, 1}, {0, 1}})
                primitive.positions.push_back(at(i + a, j + b));
        }
    }
}

/// Adds a prism around a segment.
void addRod(Primitive& primitive, const Segment& ends, double radius) {
    constexpr int kAround = 6;
    const glm::dvec3 along = unitOrZero(ends[1] - ends[0]);
    const glm::dvec3 other = std::abs(along.x) < 0.7 ? glm::dvec3(1, 0, 0) : glm::dvec3(0, 1, 0);
    const glm::dvec3 right = unitOrZero(glm::cross(along, other)), up = glm::cross(along, right);
    const auto at = [&](int i, std::size_t end) {
        const double u = 2 * std::numbers::pi * i / kAround;
        return glm::vec3(ends[end] + radius * (std::cos(u) * right + std::sin(u) * up));
    };
    for (int i = 0; i < kAround; ++i)
        for (const auto& [a, end] : {std::pair{0, 0U}, {1, 0}, {1, 1}, {0, 0}, {1, 1}, {0, 1}})
            primitive.positions.push_back(at(i + a, end));
}

void addTriangle(Primitive& primitive, const PartMesh& mesh, std::uint32_t triangle) {
    for (const glm::dvec3& corner : mesh.corners(triangle))
        primitive.positions.emplace_back(corner);
}

void addLines(Primitive& primitive, const PartMesh& mesh, const std::vector<PartEdge>& edges) {
    for (const PartEdge& edge : edges)
        for (const std::uint32_t point : {edge.a, edge.b})
            primitive.positions.emplace_back(mesh.points[point]);
}

/// Adds the segments of crossings, as rods around lines. The lines are one pixel wide: rods may be
/// thinner in a small picture. Returns the triangles of the pairs that overlap in one plane.
std::set<std::uint32_t> addCrossings(PlacesScene& scene, const PartReport& part, double radius) {
    Primitive lines, rods;
    std::set<std::uint32_t> flat;
    const CrossingCurve curve(part.turned);
    for (const CrossingPair& pair : part.crossings.pairs) {
        const std::optional<Segment> ends = curve.segment(pair);
        if (!ends) {
            flat.insert({pair.first, pair.second});
            continue;
        }
        lines.positions.insert(lines.positions.end(), ends->begin(), ends->end());
        if (lines.positions.size() <= 2 * kRods) addRod(rods, *ends, radius);
    }
    scene.add(kCrossingMark.color, 1, Topology::kLines).positions = std::move(lines.positions);
    scene.add(kCrossingMark.color, 1, Topology::kTriangles).positions = std::move(rods.positions);
    return flat;
}

void addPart(PlacesScene& scene, const PartReport& part, double ball) {
    const PartMesh& mesh = part.mesh;
    const auto lines = [&](const Mark& mark, const std::vector<PartEdge>& edges) {
        addLines(scene.add(mark.color, 1, Topology::kLines), mesh, edges);
    };
    lines(kOpenMark, part.topology.open);
    lines(kCrowdedMark, part.topology.crowded);
    Primitive& turned = scene.add(kTurnedMark.color, 1, Topology::kTriangles);
    for (const std::uint32_t t : part.topology.turned)
        addTriangle(turned, mesh, t);
    const std::set<std::uint32_t> flat = addCrossings(scene, part, kRodRadius * ball);
    Primitive& overlapping = scene.add(kCrossingMark.color, 1, Topology::kTriangles);
    for (const std::uint32_t t : flat)
        addTriangle(overlapping, mesh, t);
    // The remaining triangles of the part, translucent.
    Primitive& body = scene.add({0.3F, 0.34F, 0.4F}, 0.25F, Topology::kTriangles);
    for (std::uint32_t t = 0; t < mesh.triangles.size(); ++t)
        if (!flat.contains(t) && !std::ranges::binary_search(part.topology.turned, t))
            addTriangle(body, mesh, t);
    for (const FoundProblem& problem : part.problems) {
        if (problem.kind == PartProblem::kThinWall) continue;  // placesScene() marks thin walls
        Primitive& balls = scene.add(markOf(problem.kind).color, 1, Topology::kTriangles);
        for (const glm::dvec3& place : problem.places)
            addBall(balls, place, ball);
    }
}

/// Whether a part has an overlap without a curve: in one plane, or a shell inside another.
bool hasOverlap(const PartReport& part) {
    const CrossingCurve curve(part.turned);
    return part.shellsOf(ShellSide::kInside) > 0 ||
           std::ranges::any_of(part.crossings.pairs,
                               [&](const CrossingPair& pair) { return !curve.segment(pair); });
}

}  // namespace

Scene placesScene(const CheckReport& report) {
    PlacesScene scene;
    const double size = glm::length(report.bounds.max - report.bounds.min);
    const double ball = 0.008 * size;
    for (const PartReport& part : report.parts)
        addPart(scene, part, ball);
    if (const auto thinnest = report.thinnest()) {
        const Wall& wall = *report.parts[*thinnest].wall();
        Primitive& marks = scene.add(kWallMark.color, 1, Topology::kTriangles);
        addBall(marks, wall.from, 2 * ball);
        addBall(marks, wall.to, 2 * ball);
    }
    return scene.finish();
}

std::vector<LegendLine> placesLegend(const CheckReport& report) {
    std::vector<LegendLine> lines{
        {{1, 1, 1}, report.faulty() == 0 ? "good to print" : "not printable as it is"}};
    std::set<std::string> told;
    for (const PartReport& part : report.parts) {
        for (const FoundProblem& problem : part.problems) {
            if (problem.kind == PartProblem::kThinWall || problem.places.empty()) continue;
            const Mark& mark = markOf(problem.kind);
            if (!told.insert(mark.text).second) continue;
            const bool overlap =
                mark.color == kCrossingMark.color && std::ranges::any_of(report.parts, hasOverlap);
            lines.push_back({mark.color, overlap ? kOverlapText : mark.text});
        }
    }
    if (const auto thinnest = report.thinnest()) {
        const double thickness =
            report.unit.per_scene_unit * report.parts[*thinnest].wall()->thickness;
        std::array<char, 64> text{};
        std::snprintf(text.data(), text.size(), "%s: %.6g %s", kWallMark.text, thickness,
                      report.unit.name.c_str());
        lines.push_back({kWallMark.color, text.data()});
    }
    return lines;
}

}  // namespace peeler::cmd
