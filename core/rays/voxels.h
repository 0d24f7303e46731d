// SPDX-License-Identifier: Apache-2.0
// Voxelisation: inside tests at lattice points, by rays along three axes.
#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <memory>
#include <optional>
#include <span>
#include <vector>

#include <peeler/bundle.h>
#include <peeler/layered_image.h>
#include "core/base/parallel.h"
#include "core/rays/solids.h"

namespace peeler {

/// An array of zeroed words. The system allocates pages (large pages if possible) on first write,
/// so unwritten pages cost nothing.
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

/// Votes on the cells inside solids. Along each axis, one ray goes through the centre of every
/// cell, and its hits show whether the centre is inside any solid (Overlap). The majority of
/// the three rays decides, so a ray misled by an open edge is outvoted (Nooruddin & Turk 2003,
/// "Simplification and Repair of Polygonal Models Using Volumetric Techniques", section 3.1). Takes
/// three bits per cell.
class VoxelVotes {
  public:
    /// `lattice` gives corner, spacing and cells. Throws Error (kMemory) if there is not enough
    /// memory.
    VoxelVotes(const AxisBundles& lattice, const Solids& solids,
               Overlap overlap = Overlap::kWinding);

    /// Adds a band of the lattice's bundle along `axis` (0–2). Each band must be added once.
    void add(std::size_t axis, const Bundle& bundle, const LayeredImage& band);

    /// Counts the votes. Call this once, after the last band. The functions below are valid only
    /// after this call.
    void finish();

    /// Returns one bit per cell: (x, y, z) is bit z % 64 of word (x · cells.y + y) ·
    /// wordsOf(cells.z) + z / 64.
    std::span<const std::uint64_t> inside() const { return inside_.all(); }
    /// Writes one byte per cell of the plane at x: 1 inside, 0 outside. The index of cell (y, z) is
    /// y · cells.z + z.
    void insideAt(int x, std::span<std::uint8_t> plane) const;
    /// Like insideAt(), but writes the number of rays, 0 to 3, that find the cell inside.
    void votesAt(int x, std::span<std::uint8_t> plane) const;

    /// Returns the number of cells inside.
    std::uint64_t occupied() const { return occupied_; }
    /// Returns the number of cells on which the three rays disagree.
    std::uint64_t disputed() const { return disputed_; }

    /// Returns the bytes that add() takes besides the votes.
    std::uint64_t sidesBytes() const { return solids_.sidesBytes(overlap_); }
    static std::uint64_t cellsOf(const AxisBundles& lattice);
    /// Returns the bytes of the votes.
    static std::uint64_t bytesOf(const AxisBundles& lattice);
    /// Returns the number of 64-bit words in a line of `cells` cells along z.
    static std::size_t wordsOf(int cells) { return (static_cast<std::size_t>(cells) + 63) / 64; }

  private:
    struct Line;

    glm::dvec3 corner_;
    double spacing_;
    glm::ivec3 cells_;
    std::vector<Bundle> bundles_;
    const Solids& solids_;
    Overlap overlap_;
    std::optional<TriangleSides> sides_;    ///< of all three bundles
    std::size_t words_;                     ///< number of words in a line along z
    std::array<ZeroedWords, 3> crossings_;  ///< per axis: where its rays enter and leave solids
    ZeroedWords inside_;                    ///< cells inside by majority
    ZeroedWords odd_;  ///< cells that one or three rays find inside; lines sorted by y, then x
    std::uint64_t occupied_ = 0, disputed_ = 0;
    ObjectPool<SolidSpans> scratch_;
};

}  // namespace peeler
