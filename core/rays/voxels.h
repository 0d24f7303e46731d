// SPDX-License-Identifier: Apache-2.0
// Which points of a lattice are inside of solids, as rays along three axes say.
#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <memory>
#include <span>
#include <vector>

#include <peeler/bundle.h>
#include <peeler/layered_image.h>
#include "core/base/parallel.h"
#include "core/rays/solids.h"

namespace peeler {

/// Words that are 0. The system hands out their pages, large ones if it can, when they are first
/// written, so what stays 0 costs nothing.
class ZeroedWords {
  public:
    ZeroedWords() = default;
    /// Throws std::bad_alloc.
    explicit ZeroedWords(std::size_t count);

    std::span<std::uint64_t> all() { return {words_.get(), words_.get_deleter().count}; }
    std::span<const std::uint64_t> all() const {
        return {words_.get(), words_.get_deleter().count};
    }

  private:
    struct Free {
        std::size_t count;
        void operator()(std::uint64_t* words) const;
    };
    std::unique_ptr<std::uint64_t, Free> words_;
};

/// Counts for the centre of every cell how many of the three rays through it (one along each axis)
/// find it inside of some solid, by parity. The majority decides: a ray that an open edge misleads
/// is outvoted by the other two (Nooruddin & Turk 2003, "Simplification and Repair of Polygonal
/// Models Using Volumetric Techniques", section 3.1). Three bits a cell.
class VoxelVotes {
  public:
    /// `lattice` gives corner, spacing and cells. Throws Error (kMemory) if there is no room.
    VoxelVotes(const AxisBundles& lattice, const Solids& solids);

    /// A band of the bundle along `axis` (0–2), whose rays go through cell centres and whose sides
    /// lie along the other axes. Each once.
    void add(std::size_t axis, const Bundle& bundle, const LayeredImage& band);

    /// Counts the votes, once, after the last band. What follows is known from then on.
    void finish();

    /// A bit a cell: (x, y, z) is bit z % 64 of word (x · cells.y + y) · wordsOf(cells.z) + z / 64.
    std::span<const std::uint64_t> inside() const { return inside_.all(); }
    /// Writes a byte for every cell of a plane, (y, z) at y · cells.z + z: 1 inside, 0 outside; or
    /// the number of rays that find it inside, 0 to 3.
    void insideAt(int x, std::span<std::uint8_t> plane) const;
    void votesAt(int x, std::span<std::uint8_t> plane) const;

    std::uint64_t occupied() const { return occupied_; }  ///< cells inside
    std::uint64_t disputed() const { return disputed_; }  ///< cells of which the rays disagree

    static std::uint64_t cellsOf(const AxisBundles& lattice);
    /// Memory that the votes take.
    static std::uint64_t bytesOf(const AxisBundles& lattice);
    /// Words of a line of so many cells along z.
    static std::size_t wordsOf(int cells) { return (static_cast<std::size_t>(cells) + 63) / 64; }

  private:
    struct Scratch {
        std::vector<std::uint32_t> solids;  ///< of a ray's hits
        std::vector<std::uint8_t> states;   ///< of every solid
    };
    struct Line;

    void addRay(std::span<const float> t, std::span<const std::uint32_t> keys, Line line,
                Scratch& scratch) const;

    glm::dvec3 corner_;
    double spacing_;
    glm::ivec3 cells_;
    const Solids& solids_;
    std::size_t words_;                     ///< of a line along z
    std::array<ZeroedWords, 3> crossings_;  ///< where rays of each axis enter and leave solids
    ZeroedWords inside_;                    ///< for the majority
    ZeroedWords odd_;                       ///< for one ray or three; lines by y and x
    std::uint64_t occupied_ = 0, disputed_ = 0;
    ObjectPool<Scratch> scratch_;
};

}  // namespace peeler
