// SPDX-License-Identifier: Apache-2.0
// The findings of a check: of each part of a scene, and of all of them.
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

/// What can be wrong with a part; the table in check_text.cpp names each.
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

/// Something that is wrong, how often, and where.
struct FoundProblem {
    PartProblem kind = PartProblem::kEmpty;
    std::uint64_t count = 0;
    std::vector<glm::dvec3> places{};  ///< world space; the first few
    bool more = false;                 ///< `count` is not all
};

/// What is known of a part, or of all of them as one.
struct PartReport {
    std::string name;            ///< of its node
    int node = -1;               ///< index; -1 = all parts together
    std::uint32_t instance = 0;  ///< which of its node
    PartMesh mesh;               ///< as it is
    PartMesh turned;             ///< facing outwards
    PartTopology topology;
    std::vector<ShellSide> sides;
    Crossings crossings;
    double area = 0;
    std::optional<double> volume, union_volume;  ///< of closed ones
    FoundWall found_wall;
    bool wall_crossed = false;    ///< something goes through a face of the wall
    std::vector<PartEdge> sharp;  ///< of less than kWallAngle
    std::vector<FoundProblem> problems;

    bool good() const { return problems.empty(); }
    const std::optional<Wall>& wall() const { return found_wall.wall; }
    std::uint64_t count(PartProblem kind) const;
    std::size_t shellsOf(ShellSide side) const;
};

/// Two parts whose surfaces go through each other.
struct PartOverlap {
    std::size_t a = 0, b = 0;  ///< indices into CheckReport::parts
    std::uint64_t pairs = 0;   ///< of triangles; at least, if CheckReport::more
    glm::dvec3 place{0};
};

/// All that is known.
struct CheckReport {
    std::vector<PartReport> parts;
    double metres = 1;                 ///< a scene unit
    std::optional<double> least_wall;  ///< asked for, scene units
    /// Of several parts.
    std::vector<PartOverlap> overlaps;
    bool more = false;                           ///< overlaps
    std::optional<double> volume, union_volume;  ///< if all are closed
    Bounds bounds;

    std::size_t faulty() const;
    /// Index of the part with the thinnest wall.
    std::optional<std::size_t> thinnest() const;
};

}  // namespace peeler::cmd
