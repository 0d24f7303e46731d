// SPDX-License-Identifier: Apache-2.0
// Visibility rays: the first surface that each receiver sees along a direction.
#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <glm/glm.hpp>
#include <span>
#include <vector>

#include "core/bake/bake.h"
#include "core/bake/occluders.h"

namespace peeler {

/// Receivers, each with the distance to the first surface along a direction, or along the opposite
/// direction if the receiver faces away.
///
/// Projected along the direction, receivers are points in a plane. They are sorted into the cells
/// of a grid, and every triangle tests the receivers that it may cover, as in irregular shadow maps
/// (Aila & Laine 2004, "Alias-Free Shadow Maps"; Johnson et al. 2005, "The Irregular Z-Buffer").
/// Calculates in single precision relative to the middle of the scene. Results are bit-identical on
/// every processor. Each thread needs an object of its own.
class VisibilityRays {
  public:
    /// Hits nearer than `own_surface` (scene units) are ignored, because they belong to the
    /// receiver's own surface. The occluders must outlive this object.
    VisibilityRays(const Occluders& occluders, float own_surface)
        : occluders_(occluders), own_surface_(own_surface) {}

    /// Selects the receivers to trace from, in the given order.
    void place(const Receivers& receivers, std::span<const std::uint32_t> chosen);

    /// Traces along the unit vector `direction`: away from the receivers' surfaces or, if `inside`,
    /// into them. Ignores hits at `max_distance` or farther.
    void look(const glm::dvec3& direction, bool inside, float max_distance);

    /// Returns, for each receiver, the cosine of the angle between the direction and the receiver's
    /// normal. If look() had `inside`, the angle is measured from the opposite of the normal. A
    /// receiver with a negative cosine looks along the opposite direction. A receiver with cosine 0
    /// looks along neither direction.
    std::span<const float> cosines() const { return {cosine_.data(), count_}; }
    /// Returns, for each receiver, the distance to the first surface, in scene units; infinite if
    /// the receiver sees no surface.
    std::span<const float> distances() const { return {distance_.data(), count_}; }

    /// Returns the maximum number of bytes that an object for this many receivers takes.
    static std::uint64_t bytes(std::size_t receivers);

  private:
    /// A grid of cells, in rows. Narrow columns cost nothing: in each row, the receivers that a
    /// triangle may cover are one contiguous range, regardless of the number of columns in it.
    struct Grid {
        glm::dvec2 first{0}, cells_a_unit{1};
        int width = 1, height = 1;
    };
    void project(const glm::dmat3& frame, bool inside);
    void sort(float max_distance);
    void lookAt(const OccluderPiece& piece, const glm::dmat3& frame);

    const Occluders& occluders_;
    float own_surface_;
    std::size_t count_ = 0;
    // One value per receiver.
    std::array<std::vector<float>, 3> position_, normal_, place_;
    std::vector<float> cosine_, distance_;
    // For each receiver: its cell; after sort(), its index in the sorted arrays.
    std::vector<std::uint32_t> cell_;
    // Positions of the receivers, sorted by cell: x and y in cells, z in scene units.
    std::array<std::vector<float>, 3> sorted_;
    std::vector<float> side_, nearest_;
    Grid grid_;
    std::vector<std::uint32_t> first_;  // index of each cell's first receiver, plus an end
};

}  // namespace peeler
