// SPDX-License-Identifier: Apache-2.0
// Counts of rays with an odd number of hits on a closed surface, for peeler and for Embree.
#pragma once

#include <atomic>
#include <cstdio>
#include <memory>
#include <string>

#include <peeler/bundle.h>
#include "core/base/parallel.h"
#include "support/capture.h"
#include "support/embree_oracle.h"

namespace peeler::test {

inline CaptureSettings raySettings(HitMode hit_mode) {
    CaptureSettings settings;
    settings.hit_mode = hit_mode;
    settings.faces = Faces::kBoth;
    return settings;
}

inline std::uint64_t oddRays(const LayeredImage& image) {
    std::uint64_t odd = 0;
    for (std::size_t p = 0; p + 1 < image.offsets.size(); ++p)
        odd += image.count(p) % 2;
    return odd;
}

/// Returns the number of rays in a bundle for which Embree finds an odd number of hits.
inline std::uint64_t oddRays(const AllHits& embree, const Bundle& bundle) {
    std::atomic<std::uint64_t> odd = 0;
    const Window& crop = bundle.view.crop;
    parallelFor(static_cast<std::size_t>(crop.height()), [&](std::size_t row) {
        std::uint64_t found = 0;
        for (int x = crop.x0; x < crop.x1; ++x) {
            const double y = crop.y0 + static_cast<double>(row) + 0.5;
            const glm::dvec3 start = worldPosition(bundle.view, x + 0.5, y, 0);
            found += embree(start, bundle.direction(), false).size() % 2;
        }
        odd += found;
    });
    return odd;
}

struct OddRays {
    std::uint64_t rays = 0, hits = 0;
    std::uint64_t raw = 0, refined = 0;  ///< GL: rays with an odd number of raw or refined hits
    std::uint64_t cpu = 0;               ///< CPU: rays with an odd number of hits
    /// Embree: rays with an odd number of hits, of every fourth bundle.
    std::uint64_t embree_fast = 0, embree_robust = 0;
};

/// Counts rays over `directions` bundles. Prints the result.
inline OddRays countOddRays(const std::string& name, const Scene& scene, int directions,
                            int resolution, bool with_embree) {
    const PosedScene shown(scene);
    const Bounds all = shown.bounds().value();
    GlRenderer renderer(sharedContext(), shown);
    const std::unique_ptr<HitSource> rasterizer = openHits("cpu", shown);
    const TriangleSoup soup = soupOf(scene);
    const AllHits fast(soup, RTC_SCENE_FLAG_NONE), robust(soup);
    OddRays found;
    std::uint64_t compared = 0;
    int number = 0;
    for (const glm::dvec3& direction : sphereDirections(directions)) {
        const Bundle bundle = parallelBundle("b", all, all, direction, {resolution});
        const Captured refined = capture(renderer, bundle.view, raySettings(HitMode::kRefined));
        found.rays += bundle.rays();
        found.hits += refined.image.fragments();
        found.refined += oddRays(refined.image);
        found.raw += oddRays(capture(renderer, bundle.view, raySettings(HitMode::kRaw)).image);
        found.cpu +=
            oddRays(capture(*rasterizer, bundle.view, raySettings(HitMode::kRefined)).image);
        if (!with_embree || number++ % 4 != 0) continue;
        compared += bundle.rays();
        found.embree_fast += oddRays(fast, bundle);
        found.embree_robust += oddRays(robust, bundle);
    }
    std::printf(
        "%s: of %llu rays (%llu hits) %llu odd, refined %llu, on the CPU %llu;", name.c_str(),
        static_cast<unsigned long long>(found.rays), static_cast<unsigned long long>(found.hits),
        static_cast<unsigned long long>(found.raw), static_cast<unsigned long long>(found.refined),
        static_cast<unsigned long long>(found.cpu));
    std::printf(" Embree, of %llu of them: %llu, robust %llu\n",
                static_cast<unsigned long long>(compared),
                static_cast<unsigned long long>(found.embree_fast),
                static_cast<unsigned long long>(found.embree_robust));
    return found;
}

}  // namespace peeler::test
