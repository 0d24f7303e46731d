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

/// Receivers, and how far each sees along a direction or, if it faces the other way, against it.
///
/// Seen along the direction receivers are points of a plane. They are sorted into the cells of a
/// grid, and every triangle looks for those that it covers, as the lights of irregular shadow maps
/// do (Aila & Laine 2004, "Alias-Free Shadow Maps"; Johnson et al. 2005, "The Irregular Z-Buffer").
/// In single precision from the middle of the scene on, with the same bits on every processor. One
/// for each thread.
class VisibilityRays {
  public:
    /// Hits nearer than `own_surface` (scene units) are the surface that a receiver is on. The
    /// occluders must outlive it.
    VisibilityRays(const Occluders& occluders, float own_surface)
        : occluders_(occluders), own_surface_(own_surface) {}

    /// Takes these of the receivers, in this order.
    void place(const Receivers& receivers, std::span<const std::uint32_t> chosen);

    /// Looks along the unit vector, away from the receivers' surfaces or into them. What is not
    /// nearer than `max_distance` is not seen.
    void look(const glm::dvec3& direction, bool inside, float max_distance);

    /// Of each receiver the cosine of the direction to its normal (to the normal's opposite if it
    /// looks into the surface): negative if it looks against the direction, 0 if nowhere.
    std::span<const float> cosines() const { return {cosine_.data(), count_}; }
    /// Of each receiver, how far away is what it sees first, scene units; infinite if there is
    /// nothing.
    std::span<const float> distances() const { return {distance_.data(), count_}; }

    /// Most bytes of one with so many receivers.
    static std::uint64_t bytes(std::size_t receivers);

  private:
    /// Rows of cells. Columns are narrow: what a triangle covers of a row is one range of
    /// receivers, however many columns that are.
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
    // Of each receiver.
    std::array<std::vector<float>, 3> position_, normal_, place_;
    std::vector<float> cosine_, distance_;
    std::vector<std::uint32_t> cell_;  // then its place among the sorted ones
    // Of each receiver, cell by cell: x and y in cells, z in scene units.
    std::array<std::vector<float>, 3> sorted_;
    std::vector<float> side_, nearest_;
    Grid grid_;
    std::vector<std::uint32_t> first_;  // of each cell, and one more
};

}  // namespace peeler
