// SPDX-License-Identifier: Apache-2.0
// What is in the way of receivers: the triangles of a scene, in patches that are quick to project.
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

/// Triangles of a primitive that follow each other, with the corners that they have in common.
struct OccluderPatch {
    static constexpr std::uint32_t kMost = 256;  ///< corners, and triangles: a byte numbers them

    glm::vec3 middle{0}, half{0};  ///< of the box around it
    std::size_t first_corner = 0, first_triangle = 0;
    std::uint32_t corners = 0, triangles = 0;
    std::uint32_t first_element = 0;  ///< which of the primitive its first triangle is
};

/// The patches of a primitive where one instance of it is.
struct OccluderPiece {
    const Primitive* primitive = nullptr;
    std::size_t first_patch = 0, patches = 0;
    /// From corners to where they are in the world, from Occluders::origin() on.
    glm::dmat3 turn{1};
    glm::dvec3 offset{0};
    const AlphaTest* alpha = nullptr;  ///< null: all of it is there
    bool mirrored = false;             ///< fronts are clockwise
    bool cull_front = false, cull_back = false;
};

/// The triangles of a scene that count. Corners are floats from the middle of their primitive on,
/// so that no precision goes into where that is. Instances share them.
class Occluders {
  public:
    using Triangle = std::array<std::uint8_t, 3>;  ///< corners, from the patch's first on

    Occluders(const PosedScene& posed, Faces faces);

    /// The middle of the scene, and how large it is.
    const glm::dvec3& origin() const { return origin_; }
    double diagonal() const { return diagonal_; }
    const std::vector<OccluderPiece>& pieces() const { return pieces_; }
    std::span<const OccluderPatch> patches(const OccluderPiece& piece) const {
        return {patches_.data() + piece.first_patch, piece.patches};
    }
    /// One coordinate, 0 to 2, of the corners of a patch.
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

// patch_cover.cpp: which receivers triangles cover, and how far those are from them.

/// Receivers that look along Z or against it, cell by cell, row by row.
struct CellReceivers {
    /// So many are looked at together: there is room for as many behind the last, which see
    /// nothing.
    static constexpr std::size_t kBlock = 8;

    const std::uint32_t* first = nullptr;  ///< of each cell, and one more
    int width = 1, height = 1;             ///< cells
    glm::vec2 units_a_cell{0};             ///< scene units: how wide and high cells are
    std::array<const float*, 3> at{};      ///< x and y in cells, Z in scene units
    const float* side = nullptr;           ///< 1 = along Z, −1 = against it
    float* nearest = nullptr;              ///< distances, which become smaller
    float own_surface = 0;                 ///< hits nearer than that do not count
};

/// From a piece's corners to where the receivers are: rows of a matrix.
struct PatchView {
    std::array<glm::vec4, 3> rows{};
};

/// Lets receivers see the triangles of a patch: whoever is covered by one (a little more than it,
/// so that rounding opens no gap) and farther from it than `nearest` says is not.
using CoverPatch = void (*)(const Occluders& occluders, const OccluderPiece& piece,
                            const OccluderPatch& patch, const PatchView& view,
                            const CellReceivers& receivers);

/// The one that the piece needs: the fastest that the processor can run, or the one that every
/// processor can. The results are the same.
CoverPatch coverPatchFor(const OccluderPiece& piece, bool for_every_processor = false);

}  // namespace peeler
