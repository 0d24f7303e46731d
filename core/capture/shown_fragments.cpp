// SPDX-License-Identifier: Apache-2.0
#include "core/capture/shown_fragments.h"

#include <cstdint>
#include <limits>
#include <span>
#include <utility>

#include "core/image/layers.h"
#include "core/scene/material.h"

namespace peeler {

ShownFragments::ShownFragments(PosedScene posed) : posed_(std::move(posed)) {
    for (const DrawnSurface& surface : posed_.drawList().surfaces()) {
        const Primitive& primitive =
            posed_.primitives(posed_.meshes()[surface.instance])[surface.primitive];
        opaque_.push_back(
            !primitive.splats &&
            isOpaque(posed_.scene().materials[static_cast<std::size_t>(primitive.material)]));
    }
}

void ShownFragments::keep(Surfaces surfaces, bool opaque_only, LayeredImage& image) const {
    if (surfaces == Surfaces::kAll && !opaque_only) return;
    const std::span<const std::uint32_t> keys = image.extra.front().as<std::uint32_t>();
    std::vector<char> marked(keys.size());
    for (std::size_t pixel = 0; pixel < image.window.pixels(); ++pixel) {
        for (std::size_t i = image.offsets[pixel]; i < image.offsets[pixel + 1]; ++i) {
            const bool opaque = opaque_[posed_.drawList().surfaceOf(keys[i])] != 0;
            const bool dropped = opaque ? surfaces == Surfaces::kTransparent : opaque_only;
            marked[i] = !dropped;
            if (opaque && surfaces != Surfaces::kAll) break;
        }
    }
    keepMarked(image, marked);
}

std::vector<float> ShownFragments::nearestOpaque(const LayeredImage& image) const {
    const std::span<const std::uint32_t> keys = image.extra.front().as<std::uint32_t>();
    std::vector<float> nearest(image.window.pixels(), std::numeric_limits<float>::infinity());
    for (std::size_t pixel = 0; pixel < nearest.size(); ++pixel) {
        for (std::size_t i = image.offsets[pixel]; i < image.offsets[pixel + 1]; ++i) {
            if (!opaque_[posed_.drawList().surfaceOf(keys[i])]) continue;
            nearest[pixel] = image.z[i];
            break;
        }
    }
    return nearest;
}

}  // namespace peeler
