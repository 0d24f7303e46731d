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
    static constexpr std::uint32_t kMost = 256;  ///< corners, and triangles: indices are bytes

    glm::vec3 middle{0}, half{0};  ///< of its bounding box
    std::size_t first_corner = 0, first_triangle = 0;
    std::uint32_t corners = 0, triangles = 0;
    std::uint32_t first_element = 0;  ///< index of its first triangle in the primitive
};

/// The patches of a primitive in one of its instances.
struct OccluderPiece {
    const Primitive* primitive = nullptr;
    std::size_t first_patch = 0, patches = 0;
    /// From corners to world space relative to Occluders::origin().
    glm::dmat3 turn{1};
    glm::dvec3 offset{0};
    const AlphaTest* alpha = nullptr;  ///< null: opaque everywhere
    bool mirrored = false;             ///< fronts are clockwise
    bool cull_front = false, cull_back = false;
};

/// The triangles of a scene that occlude. Corners are floats relative to the middle of their
/// primitive, which saves precision. Instances share them.
class Occluders {
  public:
    using Triangle = std::array<std::uint8_t, 3>;  ///< corners, relative to the patch's first

    Occluders(const PosedScene& posed, Faces faces);

    /// The middle of the scene's bounding box, and the length of its diagonal.
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
    /// Receivers processed together. The arrays have a block of padding behind the last receiver,
    /// which sees nothing.
    static constexpr std::size_t kBlock = 8;

    const std::uint32_t* first = nullptr;  ///< of each cell, plus an end
    int width = 1, height = 1;             ///< cells
    glm::vec2 units_a_cell{0};             ///< scene units: width and height of a cell
    std::array<const float*, 3> at{};      ///< x and y in cells, Z in scene units
    const float* side = nullptr;           ///< 1 = along Z, −1 = against it
    float* nearest = nullptr;              ///< distances so far, updated in place
    float own_surface = 0;                 ///< nearer hits are ignored
};

/// From a piece's corners to the space of CellReceivers: rows of a matrix.
struct PatchView {
    std::array<glm::vec4, 3> rows{};
};

/// Updates `nearest` of the receivers that a patch's triangles cover. Triangles are enlarged a
/// little, so that rounding opens no gap.
using CoverPatch = void (*)(const Occluders& occluders, const OccluderPiece& piece,
                            const OccluderPatch& patch, const PatchView& view,
                            const CellReceivers& receivers);

/// Returns the function for this piece: the fastest that the processor can run, or the portable
/// one. Their results are identical.
CoverPatch coverPatchFor(const OccluderPiece& piece, bool for_every_processor = false);

}  // namespace peeler
