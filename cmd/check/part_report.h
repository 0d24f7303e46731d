// SPDX-License-Identifier: Apache-2.0
// The findings of peeler check, per part and for the whole scene.
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

/// The possible faults of a part. The table in check_text.cpp has their names.
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

/// A kind of fault, the number of faults and their places.
struct FoundProblem {
    PartProblem kind = PartProblem::kEmpty;
    std::uint64_t count = 0;
    std::vector<glm::dvec3> places{};  ///< world-space positions of the first few faults
    bool more = false;                 ///< whether `count` is only a lower bound
};

/// The findings for a part, or for all parts joined.
struct PartReport {
    std::string name;            ///< name of the part's node
    int node = -1;               ///< index of the node; −1 = all parts joined
    std::uint32_t instance = 0;  ///< index among the node's instances
    PartMesh mesh;               ///< welded; triangles oriented as in the scene
    bool was_open = false;       ///< whether there were open edges before welding
    double weld = 0;             ///< tolerance of welding, scene units
    std::uint64_t welded_points = 0;
    PartMesh turned;  ///< `mesh` with triangles oriented outwards
    PartTopology topology;
    std::vector<ShellSide> sides;
    Crossings crossings;
    double crossing_length = 0;  ///< of the crossings' segments, scene units
    double area = 0;
    std::optional<double> volume, union_volume;  ///< closed parts only; cubic scene units
    FoundWall found_wall;                        ///< between faces that no surface crosses
    /// The thinnest wall of all, if a surface crosses one of its faces.
    std::optional<Wall> crossed_wall;
    std::vector<PartEdge> sharp;  ///< edges with an angle below kWallAngle
    std::vector<FoundProblem> problems;

    bool good() const { return problems.empty(); }
    const std::optional<Wall>& wall() const { return found_wall.wall; }
    std::uint64_t count(PartProblem kind) const;
    std::size_t shellsOf(ShellSide side) const;
};

/// Two parts whose surfaces intersect.
struct PartOverlap {
    std::size_t a = 0, b = 0;  ///< indices into CheckReport::parts
    std::uint64_t pairs = 0;   ///< intersecting triangle pairs; a lower bound if CheckReport::more
    glm::dvec3 place{0};
};

/// The unit of the numbers and coordinates in texts and pictures.
struct ShownUnit {
    std::string name = "mm";
    double per_scene_unit = 1000;
};

/// The findings for the whole scene.
struct CheckReport {
    std::vector<PartReport> parts;
    double metres = 1;  ///< metres per scene unit
    ShownUnit unit;
    std::vector<PartOverlap> overlaps;
    bool more = false;  ///< whether `overlaps` is incomplete
    /// Set only if all parts are closed; cubic scene units.
    std::optional<double> volume, union_volume;
    Bounds bounds;

    std::size_t faulty() const;
    /// Returns the index of the part with the thinnest wall.
    std::optional<std::size_t> thinnest() const;
};

}  // namespace peeler::cmd
