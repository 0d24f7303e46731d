// SPDX-License-Identifier: Apache-2.0
// Occluders: the triangles of a scene, in patches that are fast to project.
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

/// Consecutive triangles of a primitive, with the corners that they share.
struct OccluderPatch {
    /// The maximum number of corners and of triangles in a patch. Their indices are stored in
    /// bytes.
    static constexpr std::uint32_t kMost = 256;

    glm::vec3 middle{0}, half{0};  ///< centre and half extent of the bounding box
    std::size_t first_corner = 0, first_triangle = 0;
    std::uint32_t corners = 0, triangles = 0;
    std::uint32_t first_element = 0;  ///< index of the first triangle in the primitive
};

/// One instance of a primitive, with the primitive's patches.
struct OccluderPiece {
    const Primitive* primitive = nullptr;
    std::size_t first_patch = 0, patches = 0;
    /// The transform from the space of the patches' corners to world space minus
    /// Occluders::origin().
    glm::dmat3 turn{1};
    glm::dvec3 offset{0};
    const AlphaTest* alpha = nullptr;  ///< null if the surface is opaque everywhere
    bool mirrored = false;             ///< whether front faces are clockwise
    bool cull_front = false, cull_back = false;
};

/// The occluding triangles of a scene. To preserve precision, corners are floats relative to the
/// middle of their primitive. Instances share the corners.
class Occluders {
  public:
    /// Corner indices, counted from the patch's first corner.
    using Triangle = std::array<std::uint8_t, 3>;

    Occluders(const PosedScene& posed, Faces faces);

    /// Return the middle of the scene's bounding box, and the length of its diagonal.
    const glm::dvec3& origin() const { return origin_; }
    double diagonal() const { return diagonal_; }
    const std::vector<OccluderPiece>& pieces() const { return pieces_; }
    std::span<const OccluderPatch> patches(const OccluderPiece& piece) const {
        return {patches_.data() + piece.first_patch, piece.patches};
    }
    /// Returns one coordinate (0 to 2) of each corner of a patch.
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

// Defined in patch_cover.cpp.

/// Receivers that look along Z or against Z, sorted by cell, row by row.
struct CellReceivers {
    /// The number of receivers that are processed together. The arrays end with a block of padding
    /// receivers, which see nothing.
    static constexpr std::size_t kBlock = 8;

    const std::uint32_t* first = nullptr;  ///< index of each cell's first receiver, then the end
    int width = 1, height = 1;             ///< size of the grid, in cells
    glm::vec2 units_a_cell{0};             ///< width and height of a cell, scene units
    std::array<const float*, 3> at{};  ///< receivers' positions: x and y in cells, Z in scene units
    const float* side = nullptr;  ///< for each receiver, 1 if it looks along Z, −1 if against Z
    float* nearest = nullptr;     ///< for each receiver, the nearest hit's distance so far; updated
    float own_surface = 0;        ///< hits at smaller distances (scene units) are ignored
};

/// The transform from a piece's corners to the space of CellReceivers: the rows of a matrix.
struct PatchView {
    std::array<glm::vec4, 3> rows{};
};

/// A function that updates CellReceivers::nearest for the receivers that a patch's triangles cover.
/// The function enlarges the triangles slightly, so that rounding opens no gaps.
using CoverPatch = void (*)(const Occluders& occluders, const OccluderPiece& piece,
                            const OccluderPatch& patch, const PatchView& view,
                            const CellReceivers& receivers);

/// Returns the fastest cover function for a piece that this processor can run or, if
/// `for_every_processor`, the portable cover function. All cover functions give identical results.
CoverPatch coverPatchFor(const OccluderPiece& piece, bool for_every_processor = false);

}  // namespace peeler
