// SPDX-License-Identifier: Apache-2.0
#include "core/rays/voxels.h"

#include <sys/mman.h>

#include <algorithm>
#include <atomic>
#include <bit>
#include <cstring>
#include <limits>
#include <new>
#include <utility>

#include <peeler/error.h>
#include "core/base/parallel.h"

namespace peeler {
namespace {

constexpr std::size_t kWordBits = 64;

std::size_t lengthOf(int cells) {
    return static_cast<std::size_t>(cells);
}

/// Returns the prefix parity of `bits`: bit i is the parity of the bits 0 to i.
std::uint64_t parityUpTo(std::uint64_t bits) {
    for (const int shift : {1, 2, 4, 8, 16, 32})
        bits ^= bits << shift;
    return bits;
}

/// Returns the number of set bits. Written without popcount, which the baseline processor may lack,
/// and in a way that compilers can vectorise.
std::uint64_t countBits(std::span<const std::uint64_t> words) {
    std::uint64_t sum = 0;
    for (std::uint64_t bits : words) {
        bits -= bits >> 1 & 0x5555555555555555U;
        bits = (bits & 0x3333333333333333U) + (bits >> 2 & 0x3333333333333333U);
        bits = (bits + (bits >> 4)) & 0x0F0F0F0F0F0F0F0FU;
        for (const int shift : {8, 16, 32})
            bits += bits >> shift;
        sum += bits & 0xFF;
    }
    return sum;
}

/// Expands eight bits to bytes of 0 or 1, lowest bit first.
std::uint64_t spreadBits(std::uint64_t bits) {
    constexpr std::uint64_t kEach = 0x0101010101010101U;
    const std::uint64_t apart = bits * kEach & 0x8040201008040201U;
    return (apart + 0x7F * kEach) >> 7 & kEach;
}

/// Writes one byte per cell of a plane. value(y, word, from) must return the bytes of eight cells
/// of line y: bits `from` to `from` + 7 of the line's word number `word`.
template <class Value>
void writePlane(std::span<std::uint8_t> plane, const glm::ivec3& cells, Value&& value) {
    static_assert(std::endian::native == std::endian::little);
    const std::size_t length = lengthOf(cells.z);
    for (std::size_t y = 0; y < lengthOf(cells.y); ++y) {
        for (std::size_t z = 0; z < length; z += 8) {
            const std::uint64_t bytes = value(y, z / kWordBits, z % kWordBits);
            std::memcpy(&plane[y * length + z], &bytes, std::min<std::size_t>(8, length - z));
        }
    }
}

/// Returns the step of one cell in this direction, which must be a unit vector along an axis.
glm::ivec3 stepAlong(const glm::dvec3& direction) {
    return {glm::round(direction)};
}

}  // namespace

ZeroedWords::ZeroedWords(std::size_t count) {
    if (count == 0) return;
    if (count > std::numeric_limits<std::size_t>::max() / sizeof(std::uint64_t)) {
        throw std::bad_alloc();
    }
    const std::size_t bytes = count * sizeof(std::uint64_t);
    void* const memory =
        mmap(nullptr, bytes, PROT_READ | PROT_WRITE, MAP_PRIVATE | MAP_ANONYMOUS, -1, 0);
    if (memory == MAP_FAILED) throw std::bad_alloc();
    madvise(memory, bytes, MADV_HUGEPAGE);  // a hint, which the system may ignore
    words_ = {static_cast<std::uint64_t*>(memory), Free{count}};
}

void ZeroedWords::Free::operator()(std::uint64_t* words) const {
    munmap(words, count * sizeof(std::uint64_t));
}

/// The bits of the cells along a ray.
struct VoxelVotes::Line {
    double start, step;  ///< cell coordinate at t = 0, and its change per unit of t
    double cells;
    std::uint64_t* words;
    /// Number of words from one cell of the line to the next; 0 if the cells are consecutive bits
    /// in words.
    std::size_t stride;
    std::uint64_t bit;
    /// Number of cells with storage, including padding. Crossings beyond the end are ignored.
    std::size_t end;

    /// Flips the bit of the first cell whose centre is at or after t, if such a cell exists.
    void cross(double t) const {
        const double place = std::clamp(start + step * t - 0.5, 0.0, cells);
        auto cell = static_cast<std::size_t>(static_cast<std::int64_t>(place));
        cell += static_cast<double>(static_cast<std::int64_t>(cell)) < place ? 1 : 0;
        if (cell >= end) return;
        if (stride > 0)
            words[cell * stride] ^= bit;
        else
            words[cell / kWordBits] ^= std::uint64_t{1} << cell % kWordBits;
    }
};

std::uint64_t VoxelVotes::cellsOf(const AxisBundles& lattice) {
    std::uint64_t cells = 1;
    for (int i = 0; i < 3; ++i)
        cells *= static_cast<std::uint64_t>(lattice.cells[i]);
    return cells;
}

std::uint64_t VoxelVotes::bytesOf(const AxisBundles& lattice) {
    return 3 * sizeof(std::uint64_t) * lengthOf(lattice.cells.x) * lengthOf(lattice.cells.y) *
           wordsOf(lattice.cells.z);
}

VoxelVotes::VoxelVotes(const AxisBundles& lattice, const Solids& solids, Overlap overlap)
    : corner_(lattice.corner),
      spacing_(lattice.spacing),
      cells_(lattice.cells),
      bundles_(lattice.bundles),
      solids_(solids),
      overlap_(overlap),
      words_(wordsOf(lattice.cells.z)) {
    try {
        for (ZeroedWords& words : crossings_)
            words = ZeroedWords(lengthOf(cells_.x) * lengthOf(cells_.y) * words_);
    } catch (const std::bad_alloc&) {
        throw Error(ErrorKind::kMemory, "no memory for the voxels", "", "ask for fewer voxels");
    }
}

/// Stores the lines of neighbouring rays together: by (x, y) for rays along y, and by (y, x) for
/// other rays. Threads divide the first coordinate among them, so no two threads write to the same
/// word.
void VoxelVotes::add(std::size_t axis, const Bundle& bundle, const LayeredImage& band) {
    constexpr int kAtOnce = 8;
    const Window& window = band.window;
    const int along = static_cast<int>(axis), outer = axis == 1 ? 0 : 1;
    const glm::dvec3 start =
        (worldPosition(bundle.view, window.x0 + 0.5, window.y0 + 0.5, 0) - corner_) / spacing_;
    glm::ivec3 first(glm::floor(start));
    first[along] = 0;
    const glm::ivec3 right = stepAlong(bundle.right()), down = stepAlong(-bundle.up());
    const bool by_rows = down[outer] != 0;
    const int shared = by_rows ? window.height() : window.width();
    const Line all{.start = start[along],
                   .step = (bundle.direction()[along] < 0 ? -1 : 1) / spacing_,
                   .cells = static_cast<double>(cells_[along]),
                   .words = crossings_[axis].all().data(),
                   .stride = axis == 2 ? 0 : words_,
                   .bit = 0,
                   .end = axis == 2 ? words_ * kWordBits : lengthOf(cells_[along])};
    const std::span<const float> t(band.z);
    const auto keys = band.extra[0].as<std::uint32_t>();
    if (!sides_) sides_ = solids_.sides(bundles_, overlap_);

    const auto line_at = [&](const glm::ivec3& cell) {
        const std::size_t inner = lengthOf(cells_[1 - outer]), z = lengthOf(cell.z);
        Line line = all;
        line.words +=
            (lengthOf(cell[outer]) * inner + lengthOf(cell[1 - outer])) * words_ + z / kWordBits;
        line.bit = std::uint64_t{1} << z % kWordBits;
        return line;
    };
    const auto addRow = [&](int x0, int x1, int y, SolidSpans& spans) {
        const std::uint32_t* const offsets =
            band.offsets.data() + band.pixelIndex(window.x0, window.y0 + y);
        const std::size_t row = offsets[x0];
        spans.prepare(keys.subspan(row, offsets[x1] - row), solids_, sides_ ? &*sides_ : nullptr,
                      nullptr, axis);
        for (int x = x0; x < x1; ++x) {
            const std::size_t begin = offsets[x], hits = offsets[x + 1] - begin;
            const glm::ivec3 cell = first + x * right + y * down;
            if (hits < 2 || glm::any(glm::lessThan(cell, glm::ivec3(0))) ||
                glm::any(glm::greaterThanEqual(cell, cells_)))
                continue;
            spans.begin(begin - row, hits);
            const Line line = line_at(cell);
            spans.forEachInside(t.subspan(begin, hits), [&](const RayInterval& interval) {
                line.cross(interval.begin);
                line.cross(interval.end);
            });
        }
    };
    parallelFor(static_cast<std::size_t>((shared + kAtOnce - 1) / kAtOnce), [&](std::size_t i) {
        const int from = static_cast<int>(i) * kAtOnce, to = std::min(from + kAtOnce, shared);
        scratch_.with([&](SolidSpans& spans) {
            const Window part = by_rows ? Window{0, from, window.width(), to}
                                        : Window{from, 0, to, window.height()};
            for (int y = part.y0; y < part.y1; ++y)
                addRow(part.x0, part.x1, y, spans);
        });
    });
}

void VoxelVotes::finish() {
    const std::size_t xs = lengthOf(cells_.x), ys = lengthOf(cells_.y);
    std::uint64_t* const along_x = crossings_[0].all().data();
    std::uint64_t* const along_y = crossings_[1].all().data();
    std::uint64_t* const along_z = crossings_[2].all().data();
    parallelFor(xs, [&](std::size_t x) {
        for (std::size_t i = (x * ys + 1) * words_; i < (x + 1) * ys * words_; ++i)
            along_y[i] ^= along_y[i - words_];
    });
    constexpr std::size_t kAhead = 8;
    std::atomic<std::uint64_t> occupied{0}, disputed{0};
    parallelFor(ys, [&](std::size_t y) {
        std::vector<std::uint64_t> inside(words_);  // parity of the crossings along x, up to cell x
        std::uint64_t majority = 0;
        for (std::size_t x = 0; x < xs; ++x) {
            std::uint64_t before = 0;  // the previous word's last bit, copied to all 64 bits
            __builtin_prefetch(&along_y[(std::min(x + kAhead, xs - 1) * ys + y) * words_]);
            for (std::size_t i = 0; i < words_; ++i) {
                std::uint64_t& along = along_y[(x * ys + y) * words_ + i];
                const std::size_t at = (y * xs + x) * words_ + i;
                if ((inside[i] | along_x[at] | along | along_z[at] | before) == 0) continue;
                const std::uint64_t a = inside[i] ^= along_x[at];
                const std::uint64_t b = along;
                const std::uint64_t c = parityUpTo(along_z[at]) ^ before;
                before = 0 - (c >> (kWordBits - 1));
                along = (a & b) | (b & c) | (c & a);
                along_z[at] = a ^ b ^ c;
                // The majority of the votes differs from their parity exactly if the rays disagree
                // (1 or 2 votes).
                along_x[at] = along ^ along_z[at];
            }
            majority += countBits({along_y + (x * ys + y) * words_, words_});
        }
        occupied += majority;
        disputed += countBits({along_x + y * xs * words_, xs * words_});
    });
    occupied_ = occupied;
    disputed_ = disputed;
    inside_ = std::move(crossings_[1]);
    odd_ = std::move(crossings_[2]);
    crossings_[0] = {};
    scratch_.free();
    sides_.reset();
}

void VoxelVotes::insideAt(int x, std::span<std::uint8_t> plane) const {
    const auto inside = inside_.all().subspan(lengthOf(x) * lengthOf(cells_.y) * words_);
    writePlane(plane, cells_, [&](std::size_t y, std::size_t word, std::size_t from) {
        return spreadBits(inside[y * words_ + word] >> from & 0xFF);
    });
}

void VoxelVotes::votesAt(int x, std::span<std::uint8_t> plane) const {
    const auto inside = inside_.all().subspan(lengthOf(x) * lengthOf(cells_.y) * words_);
    const std::span<const std::uint64_t> odd = odd_.all();
    writePlane(plane, cells_, [&](std::size_t y, std::size_t word, std::size_t from) {
        const std::size_t at = (y * lengthOf(cells_.x) + lengthOf(x)) * words_ + word;
        return 2 * spreadBits(inside[y * words_ + word] >> from & 0xFF) +
               spreadBits(odd[at] >> from & 0xFF);
    });
}

}  // namespace peeler
