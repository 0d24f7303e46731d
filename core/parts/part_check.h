// SPDX-License-Identifier: Apache-2.0
// What somebody who makes a part of a mesh has to know of it: where its surface goes through
// itself, how much it encloses, and where its walls are thinnest.
#pragma once

#include <cstdint>
#include <glm/glm.hpp>
#include <optional>
#include <utility>
#include <vector>

#include <peeler/work.h>
#include "core/parts/part_mesh.h"
#include "core/parts/triangle_tree.h"

namespace peeler {

/// What is nearer than this share of a part's size touches: as much as positions in 32-bit floats
/// are unsure of, some ten times over.
inline constexpr double kTouching = 1e-6;

/// How two triangles lie to each other.
enum class Meeting : std::uint8_t {
    kApart,
    kTouch,  ///< they have points in common, and none of them lies on both sides of the other
    kCross,  ///< they go through each other, or lie in one plane and overlap
};

/// The meeting of two triangles with at most two common corners; `near` is the distance (scene
/// units) up to which points count as lying in a plane or on a line (Möller 1997, "A Fast
/// Triangle-Triangle Intersection Test": the intervals that both cut out of the line in which their
/// planes meet). `shared` is how many corners they have in common, which is no touch.
Meeting meetingOf(const std::array<glm::dvec3, 3>& a, const std::array<glm::dvec3, 3>& b,
                  int shared, double near);

/// Where a surface goes through itself.
struct Crossings {
    bool more = false;  ///< so much touches or crosses that `pairs` has only the first
    std::vector<std::pair<std::uint32_t, std::uint32_t>> pairs;  ///< the lesser first, sorted
    /// Triangles that something not next to them touches or crosses; not all if there are more.
    std::vector<char> touched;
};
Crossings findCrossings(const TriangleTree& tree, const Progress& progress = {});
/// Whether another triangle goes through one.
bool isCrossed(const TriangleTree& tree, std::uint32_t triangle);

/// What a shell is to the others of its mesh. Outwards and inwards are told by the sign of what it
/// encloses, depth by how many of the others are around it.
enum class ShellSide : std::uint8_t {
    kOpen,       ///< it has no inside
    kFlat,       ///< its sides touch everywhere, so that it encloses nothing
    kOutside,    ///< of a body: it faces outwards, as many shells around it as make an even number
    kCavity,     ///< of a hollow: it faces inwards, an odd number of shells around it
    kInsideOut,  ///< it faces inwards, an even number of shells around it
    kInside,     ///< it faces outwards, an odd number of shells around it: overlap
};

/// Sides of PartTopology::shells.
std::vector<ShellSide> findSides(const TriangleTree& tree, const PartTopology& topology);

/// The mesh with turned triangles, and shells that are inside out, turned back.
PartMesh turnedBack(const PartMesh& mesh, const PartTopology& topology,
                    const std::vector<ShellSide>& sides);

/// The area of all triangles, scene units squared.
double areaOf(const PartMesh& mesh);
/// What the triangles enclose, cavities taken away, what overlaps as often as it is there; scene
/// units cubed. Of closed meshes that face outwards.
double volumeOf(const PartMesh& mesh);
/// What is inside at least once, scene units cubed. The surface of that is those places of the
/// surface that have no body in front of them (FreeArea). Nothing if so much crosses that it would
/// take long. `topology` and `crossings` are those of the tree's mesh, which is closed and faces
/// outwards.
std::optional<double> unionVolume(const TriangleTree& tree, const PartTopology& topology,
                                  const Crossings& crossings, const Progress& progress = {});

/// The thinnest place of a wall.
struct Wall {
    double thickness = 0;       ///< scene units
    glm::dvec3 from{0}, to{0};  ///< on both of its sides, world space
    std::uint32_t triangle = 0, opposite = 0;
};

/// Faces that are opposite within this angle have a wall between them, in degrees; faces that share
/// a corner are an edge, however thin the part gets towards it.
inline constexpr double kWallAngle = 30;
/// No place has a wall thinner by more than this share than the one that is found.
inline constexpr double kWallTolerance = 1e-4;

/// The result of a search for the thinnest wall.
struct FoundWall {
    std::optional<Wall> wall;  ///< none if no faces are opposite
    bool certain = true;       ///< otherwise so much crosses that there may be a thinner one
};

/// The thinnest wall: from a point of the surface straight into the material, against the normal of
/// its triangle, to where that leaves it again, through a face that looks the other way within
/// kWallAngle and has no corner in common with it. Of all points of the surface, not of some: pairs
/// of faces are compared where one lies behind the other, and their distance there, which is a
/// linear function, is least at a corner of what they have in common. The tree's mesh faces
/// outwards.
FoundWall thinnestWall(const TriangleTree& tree, const Progress& progress = {});

/// Edges at which the two faces of a mesh that faces outwards enclose less than kWallAngle of
/// material: towards these a part gets thin without an end.
std::vector<PartEdge> sharpEdges(const PartMesh& mesh, const PartTopology& topology);

}  // namespace peeler
