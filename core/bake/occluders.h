// SPDX-License-Identifier: Apache-2.0
// Occluders: the triangles of a scene, in patches that are quick to project.
#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <glm/glm.hpp>
#include <span>
#include <vector>

#include <peeler/capture_settings.h>
#include "core/raster/alpha_test.h"
#include "core/scene/posed_scene.h"

namespace peeler {

/// Consecutive triangles of a primitive, with the corners they share.
struct OccluderPatch {
    /// The maximum number of corners, and of triangles: indices are bytes.
    static constexpr std::uint32_t kMost = 256;

    glm::vec3 middle{0}, half{0};  ///< centre and half extent of the bounding box
    std::size_t first_corner = 0, first_triangle = 0;
    std::uint32_t corners = 0, triangles = 0;
    std::uint32_t first_element = 0;  ///< index, in the primitive, of the first triangle
};

/// One instance of a primitive, with the patches of the primitive.
struct OccluderPiece {
    const Primitive* primitive = nullptr;
    std::size_t first_patch = 0, patches = 0;
    /// The transform from the patches' corners to world space, relative to Occluders::origin().
    glm::dmat3 turn{1};
    glm::dvec3 offset{0};
    const AlphaTest* alpha = nullptr;  ///< null: opaque everywhere
    bool mirrored = false;             ///< fronts are clockwise
    bool cull_front = false, cull_back = false;
};

/// The occluding triangles of a scene. Corners are stored as floats relative to the middle of their
/// primitive, which preserves precision; instances share the corners.
class Occluders {
  public:
    /// Corner indices, counted from the patch's first corner.
    using Triangle = std::array<std::uint8_t, 3>;

    Occluders(const PosedScene& posed, Faces faces);

    /// Return the middle of the scene's bounding box, and the length of the box's diagonal.
    const glm::dvec3& origin() const { return origin_; }
    double diagonal() const { return diagonal_; }
    const std::vector<OccluderPiece>& pieces() const { return pieces_; }
    std::span<const OccluderPatch> patches(const OccluderPiece& piece) const {
        return {patches_.data() + piece.first_patch, piece.patches};
    }
    /// Returns one coordinate, 0 to 2, of the corners of a patch.
    const float* coordinates(const OccluderPatch& patch, std::size_t axis) const {
        return corners_[axis].data() + patch.first_corner;
    }
    std::span<const Triangle> triangles(const OccluderPatch& patch) const {
        return {triangles_.data() + patch.first_triangle, patch.triangles};
    }

  private:
    void addPatches(const Primitive& primitive, const std::vector<glm::vec3>& positions,
                    const glm::dvec3& middle);

    PosedScene posed_;
    glm::dvec3 origin_{0};
    double diagonal_ = 0;
    std::vector<AlphaTest> alpha_tests_;
    std::vector<OccluderPiece> pieces_;
    std::vector<OccluderPatch> patches_;
    std::array<std::vector<float>, 3> corners_;
    std::vector<Triangle> triangles_;
};

// patch_cover.cpp: finds the receivers that triangles cover, and their distances.

/// Receivers that look along Z or against it, sorted by cell, row by row.
struct CellReceivers {
    /// The number of receivers processed together. After the last receiver, the arrays have a block
    /// of padding, which sees nothing.
    static constexpr std::size_t kBlock = 8;

    const std::uint32_t* first = nullptr;  ///< index of each cell's first receiver, plus an end
    int width = 1, height = 1;             ///< size of the grid, in cells
    glm::vec2 units_a_cell{0};             ///< scene units: width and height of a cell
    std::array<const float*, 3> at{};      ///< positions: x and y in cells, Z in scene units
    const float* side = nullptr;           ///< 1 = along Z, −1 = against it
    float* nearest = nullptr;              ///< nearest distance so far, updated in place
    float own_surface = 0;                 ///< scene units; nearer hits are ignored
};

/// The transform from a piece's corners to the space of CellReceivers, as the rows of a matrix.
struct PatchView {
    std::array<glm::vec4, 3> rows{};
};

/// A function that updates `nearest` for the receivers that a patch's triangles cover. It enlarges
/// triangles slightly, so that rounding opens no gaps.
using CoverPatch = void (*)(const Occluders& occluders, const OccluderPiece& piece,
                            const OccluderPatch& patch, const PatchView& view,
                            const CellReceivers& receivers);

/// Returns the function for this piece: the fastest that this processor can run or, if
/// `for_every_processor`, the portable one. Both give identical results.
CoverPatch coverPatchFor(const OccluderPiece& piece, bool for_every_processor = false);

}  // namespace peeler
