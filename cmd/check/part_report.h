// SPDX-License-Identifier: Apache-2.0
// Check findings, per part and for the whole scene.
#pragma once

#include <cstdint>
#include <filesystem>
#include <glm/glm.hpp>
#include <optional>
#include <string>
#include <utility>
#include <vector>

#include <peeler/composite.h>
#include "cmd/cli/report.h"
#include "core/parts/crossings.h"
#include "core/parts/volumes.h"
#include "core/parts/wall_thickness.h"
#include "core/scene/posed_scene.h"

namespace peeler::cmd {

/// The faults of a part; the table in check_text.cpp names each.
enum class PartProblem : std::uint8_t {
    kEmpty,
    kOpenEdges,
    kCrowdedEdges,
    kTurnedTriangles,
    kOneSided,
    kInsideOut,
    kFlat,
    kSelfIntersections,
    kOverlaps,
    kUncertainCrossings,
    kThinWall,
    kUncertainWall,
};

/// A fault, its count and its places.
struct FoundProblem {
    PartProblem kind = PartProblem::kEmpty;
    std::uint64_t count = 0;
    std::vector<glm::dvec3> places{};  ///< world space; the first few only
    bool more = false;                 ///< `count` is a lower bound
};

/// The findings for a part, or for all parts as one.
struct PartReport {
    std::string name;            ///< of its node
    int node = -1;               ///< index; -1 = all parts together
    std::uint32_t instance = 0;  ///< index among its node's instances
    PartMesh mesh;               ///< unchanged
    PartMesh turned;             ///< oriented outwards
    PartTopology topology;
    std::vector<ShellSide> sides;
    Crossings crossings;
    double area = 0;
    std::optional<double> volume, union_volume;  ///< for closed parts
    FoundWall found_wall;
    bool wall_crossed = false;    ///< a surface crosses a face of the wall
    std::vector<PartEdge> sharp;  ///< edges below kWallAngle
    std::vector<FoundProblem> problems;

    bool good() const { return problems.empty(); }
    const std::optional<Wall>& wall() const { return found_wall.wall; }
    std::uint64_t count(PartProblem kind) const;
    std::size_t shellsOf(ShellSide side) const;
};

/// Two parts whose surfaces intersect.
struct PartOverlap {
    std::size_t a = 0, b = 0;  ///< indices into CheckReport::parts
    std::uint64_t pairs = 0;   ///< triangle pairs; a lower bound if CheckReport::more
    glm::dvec3 place{0};
};

/// The findings for the whole scene.
struct CheckReport {
    std::vector<PartReport> parts;
    double metres = 1;                 ///< per scene unit
    std::optional<double> least_wall;  ///< requested, scene units
    /// Between parts.
    std::vector<PartOverlap> overlaps;
    bool more = false;                           ///< `overlaps` is incomplete
    std::optional<double> volume, union_volume;  ///< if all are closed
    Bounds bounds;

    std::size_t faulty() const;
    /// Returns the index of the part with the thinnest wall.
    std::optional<std::size_t> thinnest() const;
};

}  // namespace peeler::cmd
