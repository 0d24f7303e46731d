// SPDX-License-Identifier: Apache-2.0
// Which points of a lattice are inside of solids, as rays along three axes say.
#pragma once

#include <cstddef>
#include <cstdint>
#include <span>
#include <vector>

#include "core/image/layered_image.h"
#include "core/rays/bundle.h"
#include "core/rays/solids.h"

namespace peeler {

/// Counts for the centre of every cell how many of the three rays through it (one along each axis)
/// find it inside of some solid, by parity. The majority decides: a ray that an open edge misleads
/// is outvoted by the other two (Nooruddin & Turk 2003, "Simplification and Repair of Polygonal
/// Models Using Volumetric Techniques", section 3.1). One byte a cell.
class VoxelVotes {
  public:
    /// `lattice` gives corner, spacing and cells. Throws Error (kMemory) if there is no room.
    VoxelVotes(const AxisBundles& lattice, const Solids& solids);

    /// A band of the bundle along `axis` (0–2), whose rays go through cell centres. Each once.
    void add(std::size_t axis, const Bundle& bundle, const LayeredImage& band);

    /// Rays that find each cell inside, 0 to 3; (x, y, z) is at (x · cells.y + y) · cells.z + z.
    std::span<const std::uint8_t> votes() const { return votes_; }
    static constexpr std::uint8_t kMajority = 2;
    static bool inside(std::uint8_t votes) { return votes >= kMajority; }

    std::uint64_t occupied() const;  ///< cells inside
    std::uint64_t disputed() const;  ///< cells of which the rays disagree

    static std::uint64_t cellsOf(const AxisBundles& lattice);

  private:
    struct Scratch {
        SolidSpans spans;
        std::vector<Stretch> inside;
    };
    void addRay(int axis, const Bundle& bundle, const LayeredImage& band, const glm::ivec2& at,
                Scratch& scratch);

    glm::dvec3 corner_;
    double spacing_;
    glm::ivec3 cells_;
    const Solids& solids_;
    std::vector<std::uint8_t> votes_;
};

}  // namespace peeler
