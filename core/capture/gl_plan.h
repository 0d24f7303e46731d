// SPDX-License-Identifier: Apache-2.0
// A plan of the GlRenderer: how a view is captured, and what the count pass has found.
#pragma once

#include <cstdint>
#include <glm/glm.hpp>
#include <optional>
#include <vector>

#include <peeler/capture_settings.h>
#include <peeler/layered_image.h>
#include <peeler/view.h>
#include <peeler/window.h>
#include "core/capture/method.h"
#include "core/fragments/hit_source.h"
#include "core/image/layers.h"

namespace peeler {

// What planning has found is kept for the capture if it is no more than this share of the budget
// (or this many bytes without one); otherwise it is found again.
inline constexpr std::uint64_t kKeptShare = 6;
inline constexpr std::uint64_t kKeptBytes = 256ULL << 20;

struct GlPlan final : CapturePlan::Details {
    View view;
    CaptureSettings settings;  ///< with the surfaces that are captured, perhaps fewer
    const MethodInfo* method = nullptr;
    std::vector<glm::dvec2> positions{};  ///< of the samples in a pixel: each is a view
    bool opaque_first = false;            ///< composites are captured by compositeVisible()
    Window drawn{};                       ///< then: outside of it there is nothing

    std::vector<std::uint64_t> clip_rows{};    ///< surfaces of clip meshes a row, of the worst view
    std::optional<DepthComplexity> counted{};  ///< of all samples together
    std::optional<DepthComplexity> merged{};   ///< of the layers they merge into
    std::uint32_t limit = 0;                   ///< nearest layers to keep; 0 = all
    double share = 0;                          ///< of a picture's work, as progress counts it

    // Only the latest plan of a renderer has these.
    std::vector<std::uint32_t> kept_counts{};  ///< of the whole crop, or empty; one view only
    std::vector<LayeredImage> kept_bands{};    ///< the bands of those counts, or empty
    int kept_passes = 0;                       ///< that these took

    bool mergesLayers() const { return positions.size() > 1 && !settings.composite; }
    bool fitsKept(std::uint64_t bytes) const {
        return bytes <= (settings.memory != 0 ? settings.memory / kKeptShare : kKeptBytes);
    }
    void freeKept() {
        kept_counts = {};
        kept_bands = {};
    }
};

}  // namespace peeler
