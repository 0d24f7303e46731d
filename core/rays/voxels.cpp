// SPDX-License-Identifier: Apache-2.0
#include "core/rays/voxels.h"

#include <algorithm>
#include <cmath>
#include <new>

#include "core/error.h"
#include "core/parallel.h"
#include "core/rays/solid_spans.h"

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
    const int a = static_cast<int>(axis), b = (a + 1) % 3, c = (a + 2) % 3;
    const std::size_t strides[3] = {static_cast<std::size_t>(cells_.y) * std::size_t(cells_.z),
                                    static_cast<std::size_t>(cells_.z), 1};
    // t of the first cell's near side: the ray may go up the axis or down.
    const double sign = bundle.direction()[a] < 0 ? -1 : 1;
    const std::span<const std::uint32_t> keys = band.extra[0].as<std::uint32_t>();
    const auto all = [](const SolidSpan&) { return true; };
    parallelFor(static_cast<std::size_t>(band.window.height()), [&](std::size_t row) {
        SolidSpans spans;
        std::vector<Stretch> inside;
        const int y = band.window.y0 + static_cast<int>(row);
        for (int x = band.window.x0; x < band.window.x1; ++x) {
            const std::size_t pixel = band.pixelIndex(x, y);
            const std::size_t begin = band.offsets[pixel], hits = band.count(pixel);
            if (hits < 2) continue;
            const glm::dvec3 start =
                (worldPosition(bundle.view, x + 0.5, y + 0.5, 0) - corner_) / spacing_;
            const double at_b = std::floor(start[b]), at_c = std::floor(start[c]);
            if (at_b < 0 || at_b >= cells_[b] || at_c < 0 || at_c >= cells_[c]) continue;
            std::uint8_t* const line = votes_.data() + static_cast<std::size_t>(at_b) * strides[b] +
                                       static_cast<std::size_t>(at_c) * strides[c];
            spans.find({band.z.data() + begin, hits}, keys.subspan(begin, hits), solids_);
            uniteSpans(spans.all(), all, inside);
            for (const Stretch& stretch : inside) {
                double from = start[a] + sign * stretch.begin / spacing_;
                double to = start[a] + sign * stretch.end / spacing_;
                if (from > to) std::swap(from, to);
                const int end = firstCell(to, cells_[a]);
                for (int i = firstCell(from, cells_[a]); i < end; ++i)
                    ++line[static_cast<std::size_t>(i) * strides[a]];
            }
        }
    });
}

std::uint64_t VoxelVotes::occupied() const {
    return static_cast<std::uint64_t>(std::ranges::count_if(votes_, inside));
}

std::uint64_t VoxelVotes::disputed() const {
    return static_cast<std::uint64_t>(
        std::ranges::count_if(votes_, [](std::uint8_t v) { return v == 1 || v == 2; }));
}

}  // namespace peeler
