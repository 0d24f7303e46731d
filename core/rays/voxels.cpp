// SPDX-License-Identifier: Apache-2.0
#include "core/rays/voxels.h"

#include <algorithm>
#include <cmath>
#include <new>

#include "core/base/error.h"
#include "core/base/parallel.h"

namespace peeler {
namespace {

/// The first cell whose centre is at or after a place (in cells from the corner), within 0 and
/// `cells`.
int firstCell(double place, int cells) {
    return static_cast<int>(std::clamp(std::ceil(place - 0.5), 0.0, double(cells)));
}

}  // namespace

std::uint64_t VoxelVotes::cellsOf(const AxisBundles& lattice) {
    std::uint64_t cells = 1;
    for (int i = 0; i < 3; ++i)
        cells *= static_cast<std::uint64_t>(lattice.cells[i]);
    return cells;
}

VoxelVotes::VoxelVotes(const AxisBundles& lattice, const Solids& solids)
    : corner_(lattice.corner), spacing_(lattice.spacing), cells_(lattice.cells), solids_(solids) {
    try {
        votes_.resize(cellsOf(lattice));
    } catch (const std::bad_alloc&) {
        throw Error(ErrorKind::kMemory, "no memory for the voxels", "", "ask for fewer of them");
    }
}

void VoxelVotes::add(std::size_t axis, const Bundle& bundle, const LayeredImage& band) {
    // Neighbouring rays share cache lines of cells, whichever way they lie.
    constexpr int kTile = 8;
    const Window& window = band.window;
    parallelFor(static_cast<std::size_t>((window.height() + kTile - 1) / kTile),
                [&](std::size_t i) {
                    Scratch scratch;
                    const int y0 = window.y0 + static_cast<int>(i) * kTile;
                    for (int x0 = window.x0; x0 < window.x1; x0 += kTile) {
                        const Window tile = intersect({x0, y0, x0 + kTile, y0 + kTile}, window);
                        for (int y = tile.y0; y < tile.y1; ++y)
                            for (int x = tile.x0; x < tile.x1; ++x)
                                addRay(static_cast<int>(axis), bundle, band, {x, y}, scratch);
                    }
                });
}

void VoxelVotes::addRay(int axis, const Bundle& bundle, const LayeredImage& band,
                        const glm::ivec2& at, Scratch& scratch) {
    const std::size_t pixel = band.pixelIndex(at.x, at.y);
    const std::size_t begin = band.offsets[pixel], hits = band.count(pixel);
    if (hits < 2) return;
    const glm::dvec3 start =
        (worldPosition(bundle.view, at.x + 0.5, at.y + 0.5, 0) - corner_) / spacing_;
    // In cells; the ray lies along the axis, so it stays in one line of them.
    glm::dvec3 cell = glm::floor(start);
    cell[axis] = 0;
    if (glm::any(glm::lessThan(cell, glm::dvec3(0))) ||
        glm::any(glm::greaterThanEqual(cell, glm::dvec3(cells_))))
        return;
    const glm::u64vec3 strides(std::uint64_t(cells_.y) * std::uint64_t(cells_.z),
                               std::uint64_t(cells_.z), 1);
    const glm::u64vec3 offsets = glm::u64vec3(cell) * strides;
    std::uint8_t* const line = votes_.data() + offsets.x + offsets.y + offsets.z;

    const auto all = [](const SolidSpan&) { return true; };
    scratch.spans.find({band.z.data() + begin, hits},
                       band.extra[0].as<std::uint32_t>().subspan(begin, hits), solids_);
    uniteSpans(scratch.spans.all(), all, scratch.inside);
    const double step = (bundle.direction()[axis] < 0 ? -1 : 1) / spacing_;
    for (const Stretch& stretch : scratch.inside) {
        const auto [from, to] =
            std::minmax({start[axis] + step * stretch.begin, start[axis] + step * stretch.end});
        const int end = firstCell(to, cells_[axis]);
        for (int i = firstCell(from, cells_[axis]); i < end; ++i)
            ++line[static_cast<std::size_t>(i) * strides[axis]];
    }
}

std::uint64_t VoxelVotes::occupied() const {
    return static_cast<std::uint64_t>(std::ranges::count_if(votes_, inside));
}

std::uint64_t VoxelVotes::disputed() const {
    return static_cast<std::uint64_t>(
        std::ranges::count_if(votes_, [](std::uint8_t v) { return v == 1 || v == 2; }));
}

}  // namespace peeler
