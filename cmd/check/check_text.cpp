// SPDX-License-Identifier: Apache-2.0
#include "cmd/check/check_text.h"

#include <algorithm>
#include <cmath>
#include <nlohmann/json.hpp>

#include "cmd/check/part_report.h"
#include "cmd/cli/report.h"
#include "core/base/printable.h"

namespace peeler::cmd {

namespace {

/// The maximum number of parts, and of problems, that the text lists; JSON lists all.
constexpr std::size_t kNamedParts = 10;
/// The maximum number of places that JSON lists per problem.
constexpr std::size_t kToldPlaces = 8;

/// The wording for a kind of problem: "3 edges are open, around 1 hole".
struct ProblemWords {
    PartProblem kind;
    const char* key;
    std::string (*text)(const PartReport& part, const FoundProblem& problem);
};

std::string atLeast(const FoundProblem& problem) {
    return problem.more ? "at least " : "";
}

std::string counted(std::uint64_t count, const std::string& noun, const char* one,
                    const char* several) {
    return countText(count, noun) + (count == 1 ? one : several);
}

constexpr ProblemWords kProblems[] = {
    {PartProblem::kEmpty, "empty",
     [](const PartReport&, const FoundProblem&) {
         return std::string("all triangles have zero area");
     }},
    {PartProblem::kOpenEdges, "openEdges",
     [](const PartReport& part, const FoundProblem& problem) {
         return counted(problem.count, "edge", " is open", " are open") + ", around " +
                countText(part.topology.holes, "hole");
     }},
    {PartProblem::kCrowdedEdges, "nonManifoldEdges",
     [](const PartReport&, const FoundProblem& problem) {
         return counted(problem.count, "edge", " has", " have") + " more than two triangles";
     }},
    {PartProblem::kTurnedTriangles, "flippedTriangles",
     [](const PartReport&, const FoundProblem& problem) {
         return counted(problem.count, "triangle", " is flipped", " are flipped") +
                " relative to adjacent triangles";
     }},
    {PartProblem::kOneSided, "oneSidedShells",
     [](const PartReport&, const FoundProblem& problem) {
         return counted(problem.count, "shell", " has", " have") +
                " only one side, like a Moebius strip";
     }},
    {PartProblem::kInsideOut, "insideOutShells",
     [](const PartReport&, const FoundProblem& problem) {
         return counted(problem.count, "shell", " is inside out", " are inside out");
     }},
    {PartProblem::kFlat, "flatShells",
     [](const PartReport&, const FoundProblem& problem) {
         return counted(problem.count, "shell", " has", " have") + " no volume";
     }},
    {PartProblem::kSelfIntersections, "selfIntersections",
     [](const PartReport&, const FoundProblem& problem) {
         return "the surface intersects itself: " + atLeast(problem) +
                counted(problem.count, "pair", " of triangles crosses", " of triangles cross");
     }},
    {PartProblem::kOverlaps, "overlaps",
     [](const PartReport&, const FoundProblem& problem) {
         return "shells overlap in " + atLeast(problem) + countText(problem.count, "place");
     }},
    {PartProblem::kUncertainCrossings, "uncertainCrossings",
     [](const PartReport&, const FoundProblem&) {
         return std::string("too many triangles touch or cross to compare all");
     }},
    {PartProblem::kThinWall, "thinWalls",
     [](const PartReport&, const FoundProblem&) {
         return std::string("the thinnest wall is thinner than --min-wall");
     }},
    {PartProblem::kUncertainWall, "uncertainWall",
     [](const PartReport&, const FoundProblem&) {
         return std::string("could not determine whether a wall is thinner than --min-wall");
     }},
};

const ProblemWords& wordsOf(PartProblem kind) {
    return *std::ranges::find(kProblems, kind, &ProblemWords::kind);
}

/// A formatter of quantities in one unit.
class Units {
  public:
    explicit Units(const ShownUnit& unit) : unit_(unit) {}

    std::string length(double length) const { return number(length, 1) + ' ' + unit_.name; }
    std::string size(const Bounds& box) const {
        const glm::dvec3 size = box.max - box.min;
        return number(size.x, 1) + " x " + number(size.y, 1) + " x " + length(size.z);
    }
    std::string area(double area) const { return number(area, 2) + ' ' + unit_.name + '2'; }
    std::string volume(double volume) const { return number(volume, 3) + ' ' + unit_.name + '3'; }
    std::string place(const glm::dvec3& p) const {
        const auto coordinate = [&](double x) {
            return number(std::abs(x) < kNearZero ? 0 : x, 1);
        };
        return "(" + coordinate(p.x) + ", " + coordinate(p.y) + ", " + coordinate(p.z) + ")";
    }

  private:
    static constexpr double kNearZero = 1e-12;  // scene units

    /// Converts `value`, in scene units to the power `power`, to the shown unit. Returns it as
    /// text.
    std::string number(double value, int power) const {
        for (int i = 0; i < power; ++i)
            value *= unit_.per_scene_unit;
        return numberText(value);
    }

    ShownUnit unit_;
};

std::string nameOf(const PartReport& part) {
    return printable(part.name) +
           (part.instance > 0 ? " #" + std::to_string(part.instance) : std::string());
}

std::string problemText(const PartReport& part, const FoundProblem& problem, const Units& units) {
    std::string text = wordsOf(problem.kind).text(part, problem);
    if (problem.kind == PartProblem::kThinWall)
        text += ": " + units.length(part.wall()->thickness);
    else if (problem.kind == PartProblem::kOverlaps && part.volume && part.union_volume)
        text += ": " + units.volume(*part.volume) + " in total, " +
                units.volume(*part.union_volume) + " in their union";
    if (!problem.places.empty())
        text += (problem.places.size() > 1 ? ", one at " : ", at ") +
                units.place(problem.places.front());
    return text;
}

std::string line(const std::string& label, const std::string& text) {
    return "  " + label + std::string(label.size() < 15 ? 15 - label.size() : 1, ' ') + text + '\n';
}

std::string shellsText(const PartReport& part) {
    std::string text = countText(part.topology.shells.size(), "shell");
    if (const std::size_t cavities = part.shellsOf(ShellSide::kCavity); cavities > 0)
        text += ", of which " + std::to_string(cavities) +
                (cavities == 1 ? " is a cavity" : " are cavities");
    return text;
}

std::string crossingsText(const PartReport& part) {
    if (part.crossings.more && part.crossings.pairs.empty())
        return "too many triangles touch to compare all";
    return (part.crossings.more ? "at least " : "") +
           countText(part.crossings.pairs.size(), "crossing");
}

std::string wallText(const Wall& wall, const Units& units) {
    return units.length(wall.thickness) + ", from " + units.place(wall.from) + " to " +
           units.place(wall.to);
}

std::string wallText(const PartReport& part, const Units& units) {
    const auto& [wall, certain] = part.found_wall;
    if (!wall && certain)
        return part.crossed_wall ? "none without crossings"
                                 : "none: no faces are opposite each other";
    std::string uncertain = certain ? "" : "not determined: " + crossingsText(part);
    if (!wall) return uncertain;
    return (certain ? "" : uncertain + "; at most ") + wallText(*wall, units);
}

std::string weldText(const PartReport& part, const Units& units) {
    return countText(part.welded_points, "point") + " of open edges, within " +
           units.length(part.weld);
}

/// Returns the volume, and the volume of the union if the surfaces cross or overlap.
std::string volumeText(const PartReport& part, const Units& units) {
    std::string sum = units.volume(*part.volume);
    if (part.union_volume &&
        part.count(PartProblem::kOverlaps) + part.count(PartProblem::kSelfIntersections) == 0)
        return sum;
    return sum + (part.union_volume ? "; the union " + units.volume(*part.union_volume)
                                    : "; the union not determined: " + crossingsText(part));
}

std::string partText(const PartReport& part, const Units& units) {
    const PartTopology& topology = part.topology;
    std::string text = nameOf(part) + ": " + (part.good() ? "good" : "not good") + '\n';
    for (const FoundProblem& problem : part.problems)
        text += line("problem", problemText(part, problem, units));
    text += line("triangles",
                 groupedText(part.mesh.triangles.size()) + " in " + shellsText(part) +
                     (part.mesh.degenerate == 0 ? std::string()
                                                : "; " + groupedText(part.mesh.degenerate) +
                                                      " more with zero area are ignored"));
    std::string surface = topology.closed() ? "closed" : "open";
    surface += topology.crowded.empty() ? ", manifold" : ", not manifold";
    surface += topology.turned.empty() && part.count(PartProblem::kInsideOut) == 0
                   ? ", facing outwards"
                   : ", not all facing outwards";
    surface += part.crossings.pairs.empty() && !part.crossings.more ? ", no crossings"
                                                                    : ", " + crossingsText(part);
    text += line("surface", surface);
    if (part.was_open) text += line("welded", weldText(part, units));
    text += line("size", units.size(part.mesh.bounds()));
    text += line("area", units.area(part.area));
    if (part.volume) text += line("volume", volumeText(part, units));
    text += line("thinnest wall", wallText(part, units));
    if (part.crossed_wall)
        text += line("crossed wall", wallText(*part.crossed_wall, units) +
                                         ", cut by a crossing: repair that first");
    if (part.sharp.empty()) return text;
    const PartEdge& edge = part.sharp.front();
    const glm::dvec3 place = (part.mesh.points[edge.a] + part.mesh.points[edge.b]) / 2.0;
    return text + line("sharp edges", counted(part.sharp.size(), "edge", " encloses", " enclose") +
                                          " less than 30 degrees, one at " + units.place(place));
}

std::string overlapsText(const CheckReport& report, const Units& units) {
    std::string text;
    for (std::size_t i = 0; i < std::min(report.overlaps.size(), kNamedParts); ++i) {
        const PartOverlap& overlap = report.overlaps[i];
        text +=
            line("overlap",
                 nameOf(report.parts[overlap.a]) + " and " + nameOf(report.parts[overlap.b]) +
                     ": " + (report.more ? "at least " : "") + countText(overlap.pairs, "pair") +
                     " of triangles, at " + units.place(overlap.place));
    }
    if (report.overlaps.size() > kNamedParts)
        text += line("", "and " + countText(report.overlaps.size() - kNamedParts, "more overlap"));
    text += line("size", units.size(report.bounds));
    const auto closed = [](const PartReport& part) { return part.volume.has_value(); };
    if (std::ranges::all_of(report.parts, closed)) {
        const std::string sum =
            report.volume ? units.volume(*report.volume) + " in total; the union " : "";
        text += line("volume", sum + (report.union_volume ? units.volume(*report.union_volume)
                                                          : "not determined: too many crossings"));
    }
    if (const auto thinnest = report.thinnest())
        text += line("thinnest wall", wallText(report.parts[*thinnest], units) + ", of " +
                                          nameOf(report.parts[*thinnest]));
    return text;
}

Json placeJson(const glm::dvec3& p) {
    return {p.x, p.y, p.z};
}

Json boundsJson(const Bounds& box) {
    return {{"min", placeJson(box.min)}, {"max", placeJson(box.max)}};
}

Json numberJson(const std::optional<double>& value) {
    return value ? Json(*value) : Json();
}

Json wallJson(const std::optional<Wall>& wall, bool crossed) {
    if (!wall) return {};
    return {{"thickness", wall->thickness},
            {"from", placeJson(wall->from)},
            {"to", placeJson(wall->to)},
            {"crossed", crossed}};
}

Json partJson(const PartReport& part) {
    const PartTopology& topology = part.topology;
    Json json;
    json["node"] = part.name;
    json["nodeIndex"] = part.node < 0 ? Json() : Json(part.node);
    json["instance"] = part.instance;
    json["verdict"] = part.good() ? "good" : "bad";
    json["closed"] = topology.closed();
    json["manifold"] = topology.closed() && topology.crowded.empty();
    json["oriented"] = topology.turned.empty() && part.count(PartProblem::kOneSided) == 0 &&
                       part.count(PartProblem::kInsideOut) == 0;
    json["triangles"] = part.mesh.triangles.size();
    json["degenerateTriangles"] = part.mesh.degenerate;
    json["shells"] = topology.shells.size();
    json["cavities"] = part.shellsOf(ShellSide::kCavity);
    json["openEdges"] = topology.open.size();
    json["holes"] = topology.holes;
    json["nonManifoldEdges"] = topology.crowded.size();
    json["flippedTriangles"] = topology.turned.size();
    json["insideOutShells"] = part.count(PartProblem::kInsideOut);
    json["flatShells"] = part.count(PartProblem::kFlat);
    json["selfIntersections"] = part.count(PartProblem::kSelfIntersections);
    json["overlaps"] = part.count(PartProblem::kOverlaps);
    json["moreCrossings"] = part.crossings.more;
    json["crossingLength"] = part.crossing_length;
    json["weldTolerance"] = part.weld;
    json["weldedPoints"] = part.welded_points;
    json["bounds"] = boundsJson(part.mesh.bounds());
    json["area"] = part.area;
    json["volume"] = numberJson(part.volume);
    json["unionVolume"] = numberJson(part.union_volume);
    json["thinnestWall"] = wallJson(part.wall(), false);
    json["crossedWall"] = wallJson(part.crossed_wall, true);
    json["thinnestWallCertain"] = part.found_wall.certain;
    json["sharpEdges"] = part.sharp.size();
    json["problems"] = Json::array();
    for (const FoundProblem& problem : part.problems) {
        Json places = Json::array();
        for (std::size_t i = 0; i < std::min(problem.places.size(), kToldPlaces); ++i)
            places.push_back(placeJson(problem.places[i]));
        json["problems"].push_back({{"kind", wordsOf(problem.kind).key},
                                    {"count", problem.count},
                                    {"places", std::move(places)}});
    }
    return json;
}

}  // namespace

std::string verdictText(const CheckReport& report) {
    const std::size_t faulty = report.faulty();
    if (faulty == 0) return "good to print";
    std::string why;
    if (report.parts.size() == 1) {
        const PartReport& part = report.parts.front();
        for (const FoundProblem& problem : part.problems)
            why += (why.empty() ? ": " : "; ") + wordsOf(problem.kind).text(part, problem);
        return "not printable as it is" + why;
    }
    return "not printable as it is: " + groupedText(faulty) + " of " +
           countText(report.parts.size(), "part") + (faulty == 1 ? " is" : " are") + " not good";
}

std::string toText(const CheckReport& report, const std::string& file) {
    const Units units(report.unit);
    std::string text = printable(file, kMostOfLine) + ": " + verdictText(report) + '\n';
    const bool several = report.parts.size() > 1;
    // Lists all parts, or only the faulty ones if there are many.
    std::size_t named = 0;
    for (const PartReport& part : report.parts) {
        if (report.parts.size() > kNamedParts && part.good()) continue;
        if (++named <= kNamedParts) text += partText(part, units);
    }
    if (named > kNamedParts)
        text += "and " + countText(named - kNamedParts, "more part") + " that " +
                (named - kNamedParts == 1 ? "is" : "are") + " not good; --json lists them all\n";
    if (several)
        text +=
            "all " + countText(report.parts.size(), "part") + ":\n" + overlapsText(report, units);
    return text;
}

Json toJson(const CheckReport& report) {
    Json json;
    json["verdict"] = report.faulty() == 0 ? "good" : "bad";
    json["metresPerUnit"] = report.metres;
    json["bounds"] = boundsJson(report.bounds);
    const bool one = report.parts.size() == 1;
    json["volume"] = numberJson(one ? report.parts.front().volume : report.volume);
    json["unionVolume"] = numberJson(one ? report.parts.front().union_volume : report.union_volume);
    const auto thinnest = report.thinnest();
    json["thinnestWall"] = thinnest ? wallJson(report.parts[*thinnest].wall(), false) : Json();
    if (thinnest) json["thinnestWall"]["part"] = *thinnest;
    json["parts"] = Json::array();
    for (const PartReport& part : report.parts)
        json["parts"].push_back(partJson(part));
    json["partOverlaps"] = Json::array();
    for (const PartOverlap& overlap : report.overlaps)
        json["partOverlaps"].push_back({{"parts", {overlap.a, overlap.b}},
                                        {"pairs", overlap.pairs},
                                        {"place", placeJson(overlap.place)}});
    return json;
}

}  // namespace peeler::cmd
