// SPDX-License-Identifier: Apache-2.0
#include "core/rays/parity.h"

#include <algorithm>

#include "core/base/parallel.h"
#include "core/rays/solid_spans.h"

namespace peeler {
namespace {

/// What some rows of a band add.
struct Share {
    std::map<std::uint32_t, SolidParity> solids;
    std::uint64_t odd_rays = 0;
};

void addRay(std::span<const SolidHits> hits, const OddRay& ray, Share& share) {
    bool odd = false;
    for (const SolidHits& solid : hits) {
        SolidParity& parity = share.solids[solid.solid];
        ++parity.rays;
        if (!solid.odd()) continue;
        odd = true;
        ++parity.odd;
        if (parity.first.size() < Parity::kKept) parity.first.push_back(ray);
    }
    if (odd) ++share.odd_rays;
}

}  // namespace

void Parity::add(std::size_t bundle, const LayeredImage& band) {
    constexpr int kRows = 16;
    const Window& window = band.window;
    const std::span<const std::uint32_t> keys = band.extra[0].as<std::uint32_t>();
    std::vector<Share> shares(static_cast<std::size_t>((window.height() + kRows - 1) / kRows));
    parallelFor(shares.size(), [&](std::size_t i) {
        SolidSpans spans;
        const int y0 = window.y0 + static_cast<int>(i) * kRows;
        for (int y = y0; y < std::min(y0 + kRows, window.y1); ++y) {
            for (int x = window.x0; x < window.x1; ++x) {
                const std::size_t pixel = band.pixelIndex(x, y);
                const std::size_t begin = band.offsets[pixel], hits = band.count(pixel);
                if (hits == 0) continue;
                spans.find({band.z.data() + begin, hits}, keys.subspan(begin, hits), solids_);
                addRay(spans.hits(), {bundle, x, y}, shares[i]);
            }
        }
    });
    for (const Share& share : shares) {
        odd_rays_ += share.odd_rays;
        for (const auto& [solid, more] : share.solids) {
            SolidParity& parity = found_[solid];
            parity.rays += more.rays;
            parity.odd += more.odd;
            for (const OddRay& ray : more.first)
                if (parity.first.size() < kKept) parity.first.push_back(ray);
        }
    }
}

}  // namespace peeler
